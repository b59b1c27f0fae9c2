/* hyst.h - the contract of a block.
 *
 * A block is a table of variables and a few functions on flat arrays owned by the caller:
 *   dim[]  sizes, chosen when a model is exported     p[]  parameters, then values that prepare() derives from them
 *   u[]    inputs (and the time, if the table has it) y[]  outputs          x[]  states, continuous ones first
 * Rules.  Parameters are constant during a run.  output() and deriv() are pure.  Only update() changes the state:
 *   update(dt > 0)  the input u was held (or a ramp up to u, see `hold`) over the last dt; x becomes the final state
 *   update(dt = 0)  initialisation: the memory takes the first input, no time passes
 *   init()          sets x from the parameters alone; prepare() is called before it and after each change of p (or, if
 *                   STEP, of dt)
 * No globals, no allocation, no libm.  Saved states, reset, threads and equal bits everywhere follow from this. */
#ifndef HYST_H
#define HYST_H
#include <math.h> /* HUGE_VAL only */
#include <stddef.h>
#include <stdint.h>

/* ---- errors: one list ------------------------------------------------------------------------------------------ */
#define HYST_ERRORS(E)                                                      \
  E(OK, "ok")                                                               \
  E(FILE, "the block file is damaged or not a block file")                  \
  E(VERSION, "the block file has a version that this binary does not read") \
  E(CRC, "the block file is damaged: its checksum does not match")          \
  E(BLOCK, "this binary has no block of this name")                         \
  E(DIM, "a size is out of range")                                          \
  E(VALUE, "a value is out of range")                                       \
  E(PREPARE, "the parameters do not fit together")                          \
  E(WIRING, "a connection names a port that does not exist")                \
  E(LOOP, "algebraic loop")                                                 \
  E(IMPLICIT, "no implicit inverse")                                        \
  E(MEMORY, "the memory provided is too small")
#define E(id, text) HYST_E_##id,
typedef enum { HYST_ERRORS(E) HYST_N_ERRORS } hyst_status;
#undef E

/* ---- the table ------------------------------------------------------------------------------------------------- */
typedef enum {
  HYST_PARAM,   /* may change at any communication point (tunable) */
  HYST_FIXED,   /* may change before the run only: the memory depends on it */
  HYST_DERIVED, /* written by prepare() only, not visible outside */
  HYST_INPUT,
  HYST_TIME, /* an input that the graph connects to the simulation time */
  HYST_OUTPUT,
  HYST_CSTATE, /* continuous state: deriv() gives its derivative */
  HYST_STATE   /* memory: changed by update() only */
} hyst_kind;

#define HYST_INF HUGE_VAL                     /* no bound */
#define HYST_POSITIVE 2.2250738585072014e-308 /* lower bound for "greater than 0" */

/* Texts and facts for people and Python.  The binary of an FMU omits them, as modelDescription.xml has the texts; there
 * the rows contain their names, because every pointer in a table costs a relocation. */
#ifdef HYST_UNDOCUMENTED
#define HYST_TOLD(...)
#define HYST_ROW_NAME char name[16]
#else
#define HYST_TOLD(...) __VA_ARGS__
#define HYST_ROW_NAME const char *name
#endif

typedef struct {
  HYST_ROW_NAME;
  hyst_kind kind;
  const char *type; /* "real", "int", "bool", or the choices of an enumeration: "zoh|foh" (value 0, 1, ...) */
  double start, lo, hi;
  HYST_TOLD(const char *size, *unit, *text;) /* the expression of the size; block->size() evaluates it */
} hyst_var;

typedef struct {
  HYST_ROW_NAME;
  int start, lo, hi;
  HYST_TOLD(const char *text;)
} hyst_dim;

/* Rate class in continuous time, see continuous.h.  Functions without the time and hysteretic blocks are
 * rate-independent: their output depends on the path of the input, not on dt. */
typedef enum {
  HYST_FUNCTION,   /* no memory: no update() */
  HYST_CONTINUOUS, /* states of a solver: deriv() */
  HYST_HYSTERETIC, /* update() follows the path of the input and ignores dt */
  HYST_SAMPLED     /* update() takes a sample; the output is held until the next one */
} hyst_rate;

enum { HYST_STEP = 1 /* prepare() uses dt */ };

/* Sensitivities: derivatives by n columns at once, each of which changes values by given amounts.  The first `dense`
 * columns may change the inputs, all states and any parameters; each of the others changes one element of one parameter
 * only, and the inputs not at all.  Matrices: [element][column]. */
typedef struct {
  int element, column;
  double size;
} hyst_change;
typedef struct {
  int64_t n, dense;
  const hyst_change *const *changes; /* of parameter row v, also derived rows: from changes[v] to changes[v + 1] */
  const double *u;
  double *x, *y;
} hyst_columns;

typedef struct {
  const char *text, *equation, *source;
  const char *family;                     /* the folder of the file */
  const char *inverts, *invert_condition; /* block that this block inverts exactly, and the condition; or NULL */
  const char *tolerance; /* accuracy of update() and output(): "rounding"; "iteration" of a root to rounding;
                          * "integration" by a rule */
  const char *hold;      /* the input within a step, if it is not "zoh" and no parameter of this name states it */
  double rule_error;     /* "integration": bound of the error relative to the output */
  double rule_step;      /* "integration" in time (s): step at which update() agrees with deriv() to 1e-6 */
  double smooth;         /* distance in inputs and states within which the tangent is accurate; 0: 1e-5 */
  /* Advances x as update() does, and with it the derivatives of the states and of the outputs.  NULL: fits take
   * differences of update() and output().  Facts for Python, since no FMU needs them. */
  void (*sensitivity)(const int *dim, const double *p, double *x, const double *u, double dt,
                      const hyst_columns *columns);
  int derives;             /* it takes the changes of derived values; else init() must read none of these */
  const char *differences; /* parameter whose derivatives are differences, or NULL */
} hyst_told;

typedef struct hyst_block {
  const char *name;
  unsigned short flags;
  unsigned short trial; /* k > 0: the graph finds the output by trial, so that input k (from 1) equals the first input;
                         * 0: output() gives it.  A wire into input k closes no loop, see core/graph/implicit.h */
  int n_dims;
  const hyst_dim *dims;
  hyst_rate rate;
  int n_vars;
  const hyst_var *vars;
  int64_t (*size)(const int *dim, int var);                     /* elements of a variable */
  const char *(*prepare)(const int *dim, double *p, double dt); /* NULL, or an error of the parameters */
  void (*init)(const int *dim, const double *p, double *x); /* NULL: the states keep the start values of the table */
  void (*output)(const int *dim, const double *p, const double *x, const double *u, double *y);
  void (*deriv)(const int *dim, const double *p, const double *x, const double *u, double *dx);
  void (*update)(const int *dim, const double *p, double *x, const double *u, double dt);
  int (*feedthrough)(const int *dim, const double *p); /* 1: y depends on the current u; NULL: it does */
  /* Tangent (directional derivative): du of the inputs and dx of the CSTATEs -> dy of output(), ddx of deriv(); exact
   * for the current memory; at a kink one-sided, in the direction of the seed.  NULL: all zero. */
  void (*tangent)(const int *dim, const double *p, const double *x, const double *u, const double *du, const double *dx,
                  double *dy, double *ddx);
  HYST_TOLD(hyst_told told;)
} hyst_block;

/* ---- one list per block, expanded several times: descriptor rows, sizes, and the locals of every function -------
 *   #define DIMS(D) D(n, start, lo, hi, "text")
 *   #define VARS(V) V(name, KIND, size, "type", "unit", start, lo, hi, "text")
 * The unit "=u" is that of the input u: of a threshold, an end of a grid.
 * A function begins with HYST_OPEN_<FUNCTION>: every variable that it may use is then a local pointer of that name,
 * and every size a local int.  Arguments end in _ so that a variable may be called u, x, y or p. */
#define HYST_ROW(name, kind, size, type, unit, start, lo, hi, text) \
  {#name, HYST_##kind, type, start, lo, hi, HYST_TOLD(#size, unit, text)},
#define HYST_DIM_ROW(name, start, lo, hi, text) {#name, start, lo, hi, HYST_TOLD(text)},
#define HYST_DIM_LOCAL(name, start, lo, hi, text) \
  const int name = *dim_++;                       \
  (void)name;
#define HYST_DIM_LOCAL64(name, start, lo, hi, text)                       \
  const int64_t name = *dim_++; /* products of sizes must not overflow */ \
  (void)name;
#define HYST_SIZE_ROW(name, kind, size, type, unit, start, lo, hi, text) (int64_t)(size),

#define HYST_LOCAL(T, from, name, size) \
  T *name = from;                       \
  from += (size);                       \
  (void)name;
#define HYST_HIDE(name, size)
#define HYST_P(name, size) HYST_LOCAL(const double, p_, name, size)
#define HYST_P_OUT(name, size) HYST_LOCAL(double, p_, name, size)
#define HYST_U(name, size) HYST_LOCAL(const double, u_, name, size)
#define HYST_X(name, size) HYST_LOCAL(const double, x_, name, size)
#define HYST_X_OUT(name, size) HYST_LOCAL(double, x_, name, size)
#define HYST_Y(name, size) HYST_LOCAL(double, y_, name, size)
#define HYST_DX(name, size) HYST_X(name, size) HYST_LOCAL(double, dx_, d_##name, size)
/* tangent.  s_u, s_x: seeds; t_y: tangent of an output; t_x: of the derivative of a state */
#define HYST_TU(name, size) HYST_U(name, size) HYST_LOCAL(const double, du_, s_##name, size)
#define HYST_TX(name, size) \
  HYST_X(name, size) HYST_LOCAL(const double, dx_, s_##name, size) HYST_LOCAL(double, ddx_, t_##name, size)
#define HYST_TY(name, size) HYST_LOCAL(double, dy_, t_##name, size)
/* sensitivity.  s_p: changes of a parameter, to end_p; s_u: of an input; s_x: of a state, to be advanced; t_y: of an
 * output, to be computed, with the value of the last call before.  The last three are rows of n_columns numbers, one
 * row for each element. */
#define HYST_SP(name, size)                                                 \
  HYST_P(name, size)                                                        \
  const hyst_change *s_##name = *changes_++, *const end_##name = *changes_; \
  (void)s_##name, (void)end_##name;
#define HYST_SU(name, size) HYST_U(name, size) HYST_LOCAL(const double, du_, s_##name, n_columns *(size))
#define HYST_SX(name, size) HYST_X_OUT(name, size) HYST_LOCAL(double, dx_, s_##name, n_columns *(size))
#define HYST_SY(name, size) HYST_LOCAL(double, dy_, t_##name, n_columns *(size))

/* What a function sees of a variable of each kind.  The columns are the functions, in the order of HYST_IN_... below.
 */
/* clang-format off */
#define HYST_SEES_PARAM   HYST_P, HYST_P,    HYST_P,     HYST_P,     HYST_P,     HYST_P,    HYST_P,  HYST_SP
#define HYST_SEES_FIXED   HYST_P, HYST_P,    HYST_P,     HYST_P,     HYST_P,     HYST_P,    HYST_P,  HYST_SP
#define HYST_SEES_DERIVED HYST_P, HYST_P,    HYST_P,     HYST_P,     HYST_P_OUT, HYST_P,    HYST_P,  HYST_SP
#define HYST_SEES_INPUT   HYST_U, HYST_U,    HYST_U,     HYST_HIDE,  HYST_HIDE,  HYST_HIDE, HYST_TU, HYST_SU
#define HYST_SEES_TIME    HYST_U, HYST_U,    HYST_U,     HYST_HIDE,  HYST_HIDE,  HYST_HIDE, HYST_TU, HYST_SU
#define HYST_SEES_OUTPUT  HYST_Y, HYST_HIDE, HYST_HIDE,  HYST_HIDE,  HYST_HIDE,  HYST_HIDE, HYST_TY, HYST_SY
#define HYST_SEES_CSTATE  HYST_X, HYST_DX,   HYST_X_OUT, HYST_X_OUT, HYST_HIDE,  HYST_HIDE, HYST_TX, HYST_SX
#define HYST_SEES_STATE   HYST_X, HYST_X,    HYST_X_OUT, HYST_X_OUT, HYST_HIDE,  HYST_HIDE, HYST_X,  HYST_SX
/* clang-format on */
#define HYST_SEEN(column, ...) column(__VA_ARGS__) /* after its expansion, the row consists of several arguments */
#define HYST_1(a, ...) a
#define HYST_2(a, b, ...) b
#define HYST_3(a, b, c, ...) c
#define HYST_4(a, b, c, d, ...) d
#define HYST_5(a, b, c, d, e, ...) e
#define HYST_6(a, b, c, d, e, f, ...) f
#define HYST_7(a, b, c, d, e, f, g, ...) g
#define HYST_8(a, b, c, d, e, f, g, h) h
#define HYST_IN_OUTPUT(name, kind, size, ...) HYST_SEEN(HYST_1, HYST_SEES_##kind)(name, size)
#define HYST_IN_DERIV(name, kind, size, ...) HYST_SEEN(HYST_2, HYST_SEES_##kind)(name, size)
#define HYST_IN_UPDATE(name, kind, size, ...) HYST_SEEN(HYST_3, HYST_SEES_##kind)(name, size)
#define HYST_IN_INIT(name, kind, size, ...) HYST_SEEN(HYST_4, HYST_SEES_##kind)(name, size)
#define HYST_IN_PREPARE(name, kind, size, ...) HYST_SEEN(HYST_5, HYST_SEES_##kind)(name, size)
#define HYST_IN_FEEDTHROUGH(name, kind, size, ...) HYST_SEEN(HYST_6, HYST_SEES_##kind)(name, size)
#define HYST_IN_TANGENT(name, kind, size, ...) HYST_SEEN(HYST_7, HYST_SEES_##kind)(name, size)
#define HYST_IN_SENSITIVITY(name, kind, size, ...) HYST_SEEN(HYST_8, HYST_SEES_##kind)(name, size)

/* functions that run between steps only are compiled for size, because every FMU contains the binary */
#if defined(__clang__)
#define HYST_COLD __attribute__((cold, minsize))
#elif defined(__GNUC__)
#define HYST_COLD __attribute__((cold))
#else
#define HYST_COLD
#endif

/* signatures; the (void)s avoid warnings if a block has no variable of a kind */
#define HYST_OUTPUT_FN(f) \
  static void f(const int *dim_, const double *p_, const double *x_, const double *u_, double *y_)
#define HYST_DERIV_FN(f) \
  static void f(const int *dim_, const double *p_, const double *x_, const double *u_, double *dx_)
#define HYST_UPDATE_FN(f) static void f(const int *dim_, const double *p_, double *x_, const double *u_, double dt)
#define HYST_INIT_FN(f) HYST_COLD static void f(const int *dim_, const double *p_, double *x_)
#define HYST_PREPARE_FN(f) HYST_COLD static const char *f(const int *dim_, double *p_, double dt)
#define HYST_FEEDTHROUGH_FN(f) HYST_COLD static int f(const int *dim_, const double *p_)
#define HYST_TANGENT_FN(f)                                                                                          \
  HYST_COLD static void f(const int *dim_, const double *p_, const double *x_, const double *u_, const double *du_, \
                          const double *dx_, double *dy_, double *ddx_)
#if defined(__GNUC__)
#define HYST_MAY_BE_UNUSED \
  __attribute__((unused)) /* a binary without texts omits the facts, and with them its caller */
#else
#define HYST_MAY_BE_UNUSED
#endif
#define HYST_SENSITIVITY_FN(f)                                                                                 \
  HYST_MAY_BE_UNUSED static void f(const int *dim_, const double *p_, double *x_, const double *u_, double dt, \
                                   const hyst_columns *columns_)
#define HYST_OPEN_OUTPUT DIMS(HYST_DIM_LOCAL) VARS(HYST_IN_OUTPUT)(void) dim_, (void)p_, (void)x_, (void)u_, (void)y_;
#define HYST_OPEN_DERIV DIMS(HYST_DIM_LOCAL) VARS(HYST_IN_DERIV)(void) dim_, (void)p_, (void)x_, (void)u_, (void)dx_;
#define HYST_OPEN_UPDATE DIMS(HYST_DIM_LOCAL) VARS(HYST_IN_UPDATE)(void) dim_, (void)p_, (void)x_, (void)u_, (void)dt;
#define HYST_OPEN_INIT DIMS(HYST_DIM_LOCAL) VARS(HYST_IN_INIT)(void) dim_, (void)p_, (void)x_;
#define HYST_OPEN_PREPARE DIMS(HYST_DIM_LOCAL) VARS(HYST_IN_PREPARE)(void) dim_, (void)p_, (void)dt;
#define HYST_OPEN_FEEDTHROUGH DIMS(HYST_DIM_LOCAL) VARS(HYST_IN_FEEDTHROUGH)(void) dim_, (void)p_;
#define HYST_OPEN_TANGENT \
  DIMS(HYST_DIM_LOCAL)    \
  VARS(HYST_IN_TANGENT)(void) dim_, (void)p_, (void)x_, (void)u_, (void)du_, (void)dx_, (void)dy_, (void)ddx_;

#define HYST_OPEN_SENSITIVITY                                                                                         \
  const int *const dims_ = dim_;                                                                                      \
  const double *const params_ = p_, *const inputs_ = u_;                                                              \
  double *const states_ = x_;                                                                                         \
  const int64_t n_columns = columns_->n;                                                                              \
  const hyst_change *const *changes_ = columns_->changes;                                                             \
  const double *du_ = columns_->u;                                                                                    \
  double *dx_ = columns_->x, *dy_ = columns_->y;                                                                      \
  DIMS(HYST_DIM_LOCAL)                                                                                                \
  VARS(HYST_IN_SENSITIVITY)(void) dims_, (void)params_, (void)inputs_, (void)states_, (void)dt, (void)dim_, (void)p_; \
  (void)x_, (void)u_, (void)changes_, (void)du_, (void)dx_, (void)dy_;
#define HYST_ADVANCE(update) update(dims_, params_, states_, inputs_, dt) /* the states, within a sensitivity */

/* The end of a block file: HYST_BLOCK(name, (.text = ..., .family = ...), .rate = ..., .output = ...). */
#define HYST_BRACED(...) {__VA_ARGS__}
#define HYST_BLOCK(id, facts, ...)                                                                         \
  static const hyst_var id##_vars[] = {VARS(HYST_ROW)};                                                    \
  static const hyst_dim id##_dims[] = {DIMS(HYST_DIM_ROW){"", 0, 0, 0, HYST_TOLD("")}}; /* may be empty */ \
  HYST_COLD static int64_t id##_size(const int *dim_, int var_) {                                          \
    DIMS(HYST_DIM_LOCAL64)                                                                                 \
    const int64_t size[] = {VARS(HYST_SIZE_ROW)};                                                          \
    (void)dim_;                                                                                            \
    return size[var_];                                                                                     \
  }                                                                                                        \
  const hyst_block hyst_##id = {.name = #id,                                                               \
                                .n_dims = sizeof id##_dims / sizeof *id##_dims - 1,                        \
                                .dims = id##_dims,                                                         \
                                .n_vars = sizeof id##_vars / sizeof *id##_vars,                            \
                                .vars = id##_vars,                                                         \
                                .size = id##_size,                                                         \
                                HYST_TOLD(.told = HYST_BRACED facts, ) __VA_ARGS__};
#endif
