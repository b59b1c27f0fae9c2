/* system_file.c - system_file.h.  The file may be damaged: every number is checked before it counts or indexes. */
#include "container/system_file.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
  char *at;
  int bad; /* nothing more is read */
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
  return r->bad ? (least > 0 ? least : 0) : (int64_t)v;
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

static told *values_told(reader *r, const char *name, int64_t *n) {
  expect(r, name);
  *n = integer(r, 0, MOST_VALUES);
  told *list = room(r, *n, sizeof *list);
  for (int64_t k = 0; !r->bad && k < *n; k++) {
    told *v = list + k;
    v->type = word(r)[0];
    v->reference = (uint32_t)integer(r, 0, UINT32_MAX);
    v->n = integer(r, 1, MOST_VALUES);
    if (!strchr("ribls", v->type) || (v->type != 'r' && v->n != 1)) r->bad = 1;
    if (v->type == 's') v->text = string(r);
    else if ((v->values = room(r, v->n, sizeof *v->values)))
      for (int64_t e = 0; e < v->n; e++) v->values[e] = number(r);
  }
  return list;
}

static uint32_t *references(reader *r, const char *name, int64_t *n) {
  expect(r, name);
  *n = integer(r, 0, MOST_VALUES);
  uint32_t *list = room(r, *n, sizeof *list);
  for (int64_t k = 0; !r->bad && k < *n; k++) list[k] = (uint32_t)integer(r, 0, UINT32_MAX);
  return list;
}

static void read_unit(reader *r, const system_file *s, unit *u) {
  master_unit *m = u->master;
  expect(r, "unit");
  u->name = string(r);
  m->kind = integer(r, 2, 3) == 2 ? MASTER_FMI2 : MASTER_FMI3;
  u->library = string(r), u->resources = string(r), u->token = string(r);
  if (strstr(u->library, "..") || strstr(u->resources, "..")) r->bad = 1;
  m->period = integer(r, 1, 1000000), m->substeps = integer(r, 1, 10000);
  m->h = number(r);
  if (!(m->h > 0)) r->bad = 1;
  m->first = integer(r, 0, s->m.n_values);
  u->parameters = values_told(r, "parameters", &u->n_parameters);
  u->inputs = values_told(r, "inputs", &u->n_inputs);
  m->vr_in = references(r, "connected", &m->n_vr_in);
  m->n_in = integer(r, m->n_vr_in, MOST_VALUES);
  int64_t *source = room(r, m->n_in, sizeof *source);
  m->source = source, m->u = room(r, m->n_in, sizeof *m->u);
  for (int64_t k = 0; !r->bad && k < m->n_in; k++) source[k] = integer(r, -1, s->m.n_values - 1), m->u[k] = number(r);
  m->vr_out = references(r, "outputs", &m->n_vr_out);
  m->n_out = integer(r, m->n_vr_out, s->m.n_values);
  if (m->first + m->n_out > s->m.n_values) r->bad = 1;
}

int system_read(char *text, system_file *s, char *why, size_t size) {
  reader r = {text, 0};
  memset(s, 0, sizeof *s);
  expect(&r, "hystfmu-system");
  integer(&r, 1, 1);
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
  for (int64_t k = 0; !r.bad && k < s->m.n_values; k++) s->m.values[k] = number(&r);
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
    free_told(u->parameters, u->n_parameters);
    free_told(u->inputs, u->n_inputs);
    free((void *)m->vr_in), free((void *)m->vr_out), free((void *)m->source), free(m->u);
  }
  free(s->m.units), free(s->m.values), free(s->units);
  memset(s, 0, sizeof *s);
}
