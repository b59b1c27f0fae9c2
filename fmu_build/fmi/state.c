/* state.c - saved states: a list of valid states per instance, and a byte form that other processes can read.
 *
 * Bytes: magic, version, length, checksum of all that follows, token of the block file, fmi_run, derivatives of inputs
 * (ahead.h), parameters, state of the graph, its memory before the last step (Event Mode); little-endian.  A pointer is
 * looked up in the list before it is followed, so that a pointer that was freed or belongs to another instance is
 * refused. */
#include "fmi/state.h"

#include <stdlib.h>
#include <string.h>

#include "core/elementary/crc.h"
#include "fmi/ahead.h"
#include "fmi/event.h"

static const char MAGIC[8] = {'H', 'Y', 'S', 'T', 'S', 'T', 'A', 'T'};
enum { VERSION = 6 };

typedef struct {
  char magic[8];
  uint32_t version, checksum;
  uint64_t length;
  char token[HYST_TOKEN];
} header;

struct fmi_saved {
  fmi_saved *next;
  fmi_run run;
  double *values; /* this struct is followed by what the bytes end with, see above */
};

static size_t n_begin(const instance *i) { return i->begin ? (size_t)fmi_n_memory(i) : 0; }
static size_t n_before_begin(const instance *i) {
  return (size_t)(fmi_n_slopes(i) + i->graph->n_p + i->graph->n_state);
}
static size_t n_values(const instance *i) { return n_before_begin(i) + n_begin(i); }
static size_t byte_size(const instance *i) { return sizeof(header) + sizeof(fmi_run) + n_values(i) * sizeof(double); }

/* the state if it belongs to this instance */
static fmi_saved *seek(const instance *i, const void *state) {
  fmi_saved *s = i->saved;
  while (s && s != state) s = s->next;
  return s;
}

/* the same; NULL after a message */
static fmi_saved *find(const instance *i, const void *state) {
  fmi_saved *s = seek(i, state);
  if (!s) fmi_refuse(i, "The FMU state was freed or does not belong to this instance.");
  return s;
}

static fmi_saved *make(instance *i) {
  fmi_saved *s = (fmi_saved *)malloc(sizeof *s + n_values(i) * sizeof(double));
  if (!s) return fmi_refuse(i, "out of memory"), (fmi_saved *)NULL;
  s->values = (double *)(s + 1);
  s->next = i->saved;
  i->saved = s;
  return s;
}

fmi_status fmi_save(instance *i, void **state) {
  if (!state) return fmi_refuse(i, "No place for the FMU state was given.");
  fmi_saved *s = *state ? find(i, *state) : make(i); /* a given state is overwritten */
  if (!s) return FMI_ERROR;
  hyst_graph *g = i->graph;
  fmi_undo_event(i);
  s->run = i->run;
  s->run.changed = g->changed;
  s->run.dt = g->dt;
  const int64_t n = fmi_n_slopes(i);
  if (n) memcpy(s->values, i->slopes, (size_t)n * sizeof(double));
  memcpy(s->values + n, g->p, (size_t)g->n_p * sizeof(double));
  memcpy(s->values + n + g->n_p, g->state, (size_t)g->n_state * sizeof(double));
  if (i->begin) memcpy(s->values + n_before_begin(i), i->begin, n_begin(i) * sizeof(double));
  *state = s;
  return FMI_OK;
}

fmi_status fmi_restore(instance *i, void *state) {
  const fmi_saved *s = find(i, state);
  if (!s) return FMI_ERROR;
  hyst_graph *g = i->graph;
  i->run = s->run;
  i->tried = 0;
  g->changed = s->run.changed;
  g->dt = s->run.dt;
  const int64_t n = fmi_n_slopes(i);
  if (n) memcpy(i->slopes, s->values, (size_t)n * sizeof(double));
  memcpy(g->p, s->values + n, (size_t)g->n_p * sizeof(double));
  memcpy(g->state, s->values + n + g->n_p, (size_t)g->n_state * sizeof(double));
  if (i->begin) memcpy(i->begin, s->values + n_before_begin(i), n_begin(i) * sizeof(double));
  memset(i->broken, 0, (size_t)g->n_external); /* the inputs of the state are finite */
  i->n_broken = 0;
  return FMI_OK;
}

fmi_status fmi_forget(instance *i, void **state) {
  if (!state || !*state) return FMI_OK; /* the standards: a null pointer is ignored */
  fmi_saved *s = find(i, *state);
  if (!s) return FMI_ERROR;
  fmi_saved **at = &i->saved;
  while (*at != s) at = &(*at)->next;
  *at = s->next;
  free(s);
  *state = NULL;
  return FMI_OK;
}

fmi_status fmi_saved_size(instance *i, void *state, size_t *size) {
  if (!find(i, state)) return FMI_ERROR;
  *size = byte_size(i);
  return FMI_OK;
}

fmi_status fmi_serialize(instance *i, void *state, unsigned char *bytes, size_t size) {
  const fmi_saved *s = find(i, state);
  if (!s) return FMI_ERROR;
  if (!bytes || size < byte_size(i))
    return fmi_refuse(i, "The serialized state needs %lu bytes. Got room for %lu.", (unsigned long)byte_size(i),
                      (unsigned long)size);
  header h;
  memset(&h, 0, sizeof h);
  h.version = VERSION, h.length = byte_size(i);
  memcpy(h.magic, MAGIC, sizeof MAGIC);
  memcpy(h.token, i->graph->token, sizeof h.token);
  memcpy(bytes + sizeof h, &s->run, sizeof s->run);
  memcpy(bytes + sizeof h + sizeof s->run, s->values, n_values(i) * sizeof(double));
  memcpy(bytes, &h, sizeof h);
  const size_t covered = offsetof(header, length);
  h.checksum = hyst_crc32(bytes + covered, byte_size(i) - covered);
  memcpy(bytes, &h, sizeof h);
  return FMI_OK;
}

static const char *wrong_header(const instance *i, const unsigned char *bytes, size_t size) {
  header h;
  if (!bytes || size < sizeof h) return "it is too short";
  memcpy(&h, bytes, sizeof h);
  if (memcmp(h.magic, MAGIC, sizeof MAGIC) != 0) return "it is not a state of such a unit";
  if (h.version != VERSION) return "its version is unknown";
  if (h.length > size) return "it is truncated";
  if (memcmp(h.token, i->graph->token, sizeof h.token) != 0) return "it was saved by another model";
  if (h.length != byte_size(i)) return "it belongs to another interface of the standard"; /* equal models: ahead.h */
  const size_t covered = offsetof(header, length);
  if (h.checksum != hyst_crc32(bytes + covered, byte_size(i) - covered)) return "its checksum does not match";
  return NULL;
}

static int legal_run(const fmi_run *r) {
  const double values[] = {r->t, r->clock, r->stop, r->dt, r->start, r->samples, r->redo};
  for (size_t k = 0; k < sizeof values / sizeof *values; k++)
    if (!fmi_is_finite(values[k])) return 0;
  if (!(r->dt >= 0 && r->dt <= FMI_MOST_STEP && r->redo >= 0 && r->redo <= FMI_MOST_STEP)) return 0;
  switch (r->phase) {
    case EVENT: return r->interface == MODEL_EXCHANGE || r->event_mode;
    case STEPPING: return r->interface == CO_SIMULATION;
    case CONTINUOUS: return r->interface == MODEL_EXCHANGE;
    default: return r->phase == INSTANTIATED || r->phase == INITIALIZATION || r->phase == TERMINATED;
  }
}

/* A state must not contain values that a set call would refuse.  Memories are not checked: blocks trust no count or
 * index in them (core/memory/stored.h), and prepare() derives its values again. */
static int legal(const instance *i, const fmi_saved *s) {
  const hyst_graph *g = i->graph;
  const double *values = s->values + fmi_n_slopes(i);
  if (!legal_run(&s->run) || (s->run.moving && !fmi_n_slopes(i))) return 0;
  for (const double *slope = s->values; slope < values; slope++)
    if (!fmi_is_finite(*slope)) return 0;
  for (int k = 0; k < g->n_ports; k++) {
    const hyst_port *p = g->ports + k;
    if (p->kind == HYST_OUTPUT) continue;
    const double *own = p->kind == HYST_INPUT ? values + g->n_p + (p->value - g->state) : values + (p->value - g->p);
    for (int64_t e = 0; e < p->size; e++)
      if (hyst_check(p->row, own[e])) return 0;
  }
  return 1;
}

fmi_status fmi_deserialize(instance *i, const unsigned char *bytes, size_t size, void **state) {
  if (!state) return fmi_refuse(i, "No place for the FMU state was given.");
  const char *wrong = wrong_header(i, bytes, size);
  if (wrong) return fmi_refuse(i, "The serialized state cannot be read: %s.", wrong);
  fmi_saved *s = make(i);
  if (!s) return FMI_ERROR;
  memcpy(&s->run, bytes + sizeof(header), sizeof s->run);
  memcpy(s->values, bytes + sizeof(header) + sizeof s->run, n_values(i) * sizeof(double));
  void *made = s;
  wrong = s->run.interface != i->kind.interface || s->run.event_mode != i->kind.event_mode
              ? "it belongs to another interface of the standard"
          : legal(i, s) ? NULL
                        : "a value is out of range";
  if (wrong) {
    fmi_forget(i, &made);
    return fmi_refuse(i, "The serialized state cannot be read: %s.", wrong);
  }
  s->run.changed = s->run.stale = 1;
  /* the standards give *state no value before the call, so it may be uninitialised; a state of this instance would be
   * lost and is freed */
  if (seek(i, *state)) fmi_forget(i, state);
  *state = s;
  return FMI_OK;
}
