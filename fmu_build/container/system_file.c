/* system_file.c - system_file.h.  The file may be damaged: every number is checked before it counts or indexes. */
#include "container/system_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
  char *at;
  bool bad; /* nothing more is read */
} reader;

static char *word(reader *r) {
  char *w = r->at + strspn(r->at, " \n");
  char *end = w + strcspn(w, " \n");
  if (end == w) r->bad = 1;
  r->at = *end ? end + 1 : end;
  *end = 0;
  return w;
}

static void expect(reader *r, const char *name) {
  if (strcmp(word(r), name) != 0) r->bad = 1;
}

static int64_t integer(reader *r, int64_t least, int64_t most) {
  char *end;
  const char *w = word(r);
  const long long v = strtoll(w, &end, 10);
  if (*end || end == w || v < least || v > most) r->bad = 1;
  return r->bad ? least : (int64_t)v;
}

static double number(reader *r) {
  char *end;
  const char *w = word(r);
  const uint64_t bits = strtoull(w, &end, 16);
  double v;
  memcpy(&v, &bits, sizeof v);
  if (*end || strlen(w) != 16 || !(v - v == 0)) r->bad = 1;
  return r->bad ? 0 : v;
}

static int hex(char c) { return c >= '0' && c <= '9' ? c - '0' : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1; }

static char *string(reader *r) {
  char *from = word(r), *to = from, *w = from;
  if (!strcmp(from, "%")) *from = 0;
  for (; *from; from++) {
    const int hi = *from == '%' ? hex(from[1]) : 0, lo = *from == '%' && hi >= 0 ? hex(from[2]) : 0;
    if (hi < 0 || lo < 0 || (*from == '%' && hi + lo == 0)) return r->bad = 1, w;
    if (*from == '%') *to++ = (char)(hi * 16 + lo), from += 2;
    else *to++ = *from;
  }
  *to = 0;
  return w;
}

static void *room(reader *r, int64_t n, size_t size) {
  void *made = r->bad ? NULL : calloc((size_t)n + 1, size);
  if (!made) r->bad = 1;
  return made;
}

static const value_type *type(reader *r, int fmi) {
  const char *w = word(r);
  const value_type *found = w[0] && !w[1] ? value_type_of(w[0], fmi) : NULL;
  if (!found) r->bad = 1;
  return found;
}

static told *values_told(reader *r, const char *name, int fmi, int64_t *n) {
  expect(r, name);
  *n = integer(r, 0, MOST_VALUES);
  told *list = room(r, *n, sizeof *list);
  for (int64_t k = 0; !r->bad && k < *n; k++) {
    told *v = list + k;
    v->type = type(r, fmi);
    v->reference = (uint32_t)integer(r, 0, UINT32_MAX);
    v->n = integer(r, 1, MOST_VALUES);
    if (!v->type || (fmi == 2 && v->n != 1)) r->bad = 1;
    else v->values = room(r, v->n, v->type->size);
    for (int64_t e = 0; !r->bad && e < v->n; e++) {
      char *at = (char *)v->values + (size_t)e * v->type->size;
      if (v->type->letter == 's') *(char **)at = string(r);
      else if (value_from_text(v->type, word(r), at)) r->bad = 1;
    }
  }
  return list;
}

/* Connected inputs, with their sources, or outputs: variables of one type that follow each other are one batch. */
static batch *variables(reader *r, unit *u, int64_t n_values, uint32_t **references, int64_t *n_references, int64_t *n,
                        int64_t *n_batches, int64_t *source) {
  batch *list = room(r, *n_references, sizeof *list);
  uint32_t *reference = *references = room(r, *n_references, sizeof **references);
  int64_t at = 0, made = 0;
  for (int64_t k = 0; !r->bad && k < *n_references; k++) {
    const value_type *t = type(r, u->fmi);
    char *name = string(r);
    reference[k] = (uint32_t)integer(r, 0, UINT32_MAX);
    const int64_t size = integer(r, 1, *n - at);
    if (r->bad || t->letter == 's' || (u->fmi == 2 && size != 1)) r->bad = 1;
    if (r->bad) break;
    if (!made || list[made - 1].type != t) {
      const batch new = {t, k, 0, at, 0, NULL};
      list[made++] = new;
    }
    list[made - 1].n_references++, list[made - 1].n += size;
    for (const int64_t end = at + size; at < end; at++)
      if (source) u->names[at] = name, source[at] = integer(r, -1, n_values - 1), u->master->u[at] = number(r);
  }
  if (at != *n) r->bad = 1;
  *n_batches = made;
  return list;
}

static void read_unit(reader *r, const system_file *s, unit *u) {
  master_unit *m = u->master;
  uint32_t *references = NULL;
  expect(r, "unit");
  u->name = string(r);
  u->fmi = (int)integer(r, 2, 3);
  m->kind = MASTER_FMI2; /* the functions of unit.c have its form */
  u->library = string(r), u->resources = string(r), u->token = string(r);
  if (strstr(u->library, "..") || strstr(u->resources, "..")) r->bad = 1;
  m->period = integer(r, 1, 1000000), m->substeps = integer(r, 1, 10000);
  m->h = number(r);
  if (!(m->h > 0)) r->bad = 1;
  m->first = integer(r, 0, s->m.n_values);
  u->structural = values_told(r, "structural", u->fmi, &u->n_structural);
  if (u->fmi == 2 && u->n_structural) r->bad = 1;
  u->parameters = values_told(r, "parameters", u->fmi, &u->n_parameters);
  u->inputs = values_told(r, "inputs", u->fmi, &u->n_inputs);
  expect(r, "connected");
  m->n_vr_in = integer(r, 0, MOST_VALUES);
  m->n_in = integer(r, m->n_vr_in, MOST_VALUES);
  int64_t *source = room(r, m->n_in, sizeof *source);
  m->source = source, m->u = room(r, m->n_in, sizeof *m->u), u->names = room(r, m->n_in, sizeof *u->names);
  u->sets = variables(r, u, s->m.n_values, &references, &m->n_vr_in, &m->n_in, &u->n_sets, source);
  m->vr_in = references, references = NULL;
  expect(r, "outputs");
  m->n_vr_out = integer(r, 0, s->m.n_values);
  m->n_out = integer(r, m->n_vr_out, s->m.n_values);
  u->gets = variables(r, u, s->m.n_values, &references, &m->n_vr_out, &m->n_out, &u->n_gets, NULL);
  m->vr_out = references;
  u->room = room(r, m->n_in > m->n_out ? m->n_in : m->n_out, sizeof(double));
  if (m->first + m->n_out > s->m.n_values) r->bad = 1;
}

bool system_read(char *text, system_file *s, char *why, size_t size) {
  reader r = {text, 0};
  memset(s, 0, sizeof *s);
  expect(&r, "hystfmu-system");
  integer(&r, 2, 2);
  expect(&r, "token");
  s->token = string(&r);
  expect(&r, "coupling");
  s->m.scheme = integer(&r, 0, 1) ? MASTER_JACOBI : MASTER_GAUSS_SEIDEL;
  s->m.ripple = integer(&r, 1, 1000);
  s->m.base = number(&r), s->m.h = number(&r);
  if (!(s->m.base > 0 && s->m.h > 0)) r.bad = 1;
  expect(&r, "values");
  s->m.n_values = integer(&r, 0, MOST_VALUES);
  s->m.values = room(&r, s->m.n_values, sizeof(double));
  s->types = room(&r, s->m.n_values, 1);
  for (int64_t k = 0; !r.bad && k < s->m.n_values; k++) {
    const value_type *t = type(&r, 2);
    union {
      double real;
      int32_t whole;
    } fits;
    s->m.values[k] = number(&r);
    if (!t || t->letter == 's' || value_from_double(t, s->m.values[k], &fits)) r.bad = 1;
    else s->types[k] = t->letter;
  }
  expect(&r, "units");
  const int64_t n = integer(&r, 1, MOST_UNITS);
  s->m.units = room(&r, n, sizeof *s->m.units), s->units = room(&r, n, sizeof *s->units);
  for (int64_t k = 0; !r.bad && k < n; k++) {
    s->units[k].master = s->m.units + k;
    s->m.n_units = k + 1;
    read_unit(&r, s, s->units + k);
  }
  if (r.bad) snprintf(why, size, "resources/system.txt is damaged near its byte %ld", (long)(r.at - text));
  return r.bad;
}

static void free_told(told *list, int64_t n) {
  for (int64_t k = 0; list && k < n; k++) free(list[k].values);
  free(list);
}

void system_free(system_file *s) {
  for (int64_t k = 0; k < s->m.n_units; k++) {
    unit *u = s->units + k;
    master_unit *m = u->master;
    free_told(u->structural, u->n_structural);
    free_told(u->parameters, u->n_parameters);
    free_told(u->inputs, u->n_inputs);
    free(u->sets), free(u->gets), free(u->names), free(u->room);
    free((void *)m->vr_in), free((void *)m->vr_out), free((void *)m->source), free(m->u);
  }
  free(s->m.units), free(s->m.values), free(s->types), free(s->units);
  memset(s, 0, sizeof *s);
}
