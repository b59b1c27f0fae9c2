/* A device as it is: converter, delay, plays, bend, creep, one or two modes.  Independent of the core on purpose.
 *
 * The command is held for a step of the loop; everything else moves on a grid `fine` times finer.  Lags and modes are
 * discretised exactly for an input that is held on that grid; the caller makes their matrices. */
#include <stdint.h>

enum { PLAYS = 16, LAGS = 4, MODES = 2, LATE = 256 };

typedef struct {
  int64_t fine, delay, n_plays, n_lags, n_modes, at; /* delay in fine steps; at: place in the line of late commands */
  double low, high;                                  /* the amplifier clips */
  double middle, half;                               /* of the command: x = (u - middle) / half */
  double w0, q2, q3, gain, offset;
  double r[PLAYS], w[PLAYS], z[PLAYS];
  double share[LAGS], keep[LAGS], lag[LAGS]; /* keep: exp(-h / tau) */
  double part[MODES], A[MODES][4], B[MODES][2], mode[MODES][2];
  double late[LATE];
} device;

double device_output(const device *d) {
  double y = 0;
  for (int i = 0; i < d->n_modes; i++) y += d->part[i] * d->mode[i][0];
  return d->offset + d->gain * y;
}

static void fine_step(device *d, double u) {
  if (d->delay > 0) {
    const double now = d->late[d->at];
    d->late[d->at] = u;
    d->at = (d->at + 1) % d->delay;
    u = now;
  }
  const double x = (u - d->middle) / d->half;
  double v = d->w0 * x;
  for (int i = 0; i < d->n_plays; i++) {
    if (d->z[i] < x - d->r[i]) d->z[i] = x - d->r[i];
    if (d->z[i] > x + d->r[i]) d->z[i] = x + d->r[i];
    v += d->w[i] * d->z[i];
  }
  const double bent = v + d->q2 * v * v + d->q3 * v * v * v;
  double s = bent;
  for (int i = 0; i < d->n_lags; i++) {
    s += d->share[i] * d->lag[i];
    d->lag[i] = bent + d->keep[i] * (d->lag[i] - bent);
  }
  for (int i = 0; i < d->n_modes; i++) {
    const double *A = d->A[i], *B = d->B[i], a = d->mode[i][0], b = d->mode[i][1];
    d->mode[i][0] = A[0] * a + A[1] * b + B[0] * s;
    d->mode[i][1] = A[2] * a + A[3] * b + B[1] * s;
  }
}

/* y[k] is sampled when u[k] is set; u[k] is held until the next sample */
void device_run(device *d, int64_t n, const double *u, double *y) {
  for (int64_t k = 0; k < n; k++) {
    y[k] = device_output(d);
    const double held = u[k] < d->low ? d->low : u[k] > d->high ? d->high : u[k];
    for (int64_t i = 0; i < d->fine; i++) fine_step(d, held);
  }
}

/* holds u for one step of the loop; the sample at its end */
double device_step(device *d, double u) {
  double y;
  device_run(d, 1, &u, &y);
  return device_output(d);
}

/* at rest under a command that has been there for ever; the plays stand where a rise from their middle left them */
void device_rest(device *d, double u) {
  const double x = (u - d->middle) / d->half;
  double v = d->w0 * x, total = 1;
  for (int i = 0; i < d->n_plays; i++) {
    d->z[i] = x > d->r[i] ? x - d->r[i] : x < -d->r[i] ? x + d->r[i] : 0;
    v += d->w[i] * d->z[i];
  }
  const double bent = v + d->q2 * v * v + d->q3 * v * v * v;
  for (int i = 0; i < d->n_lags; i++) {
    d->lag[i] = bent;
    total += d->share[i];
  }
  for (int i = 0; i < d->n_modes; i++) {
    d->mode[i][0] = total * bent;
    d->mode[i][1] = 0;
  }
  for (int i = 0; i < LATE; i++) d->late[i] = u;
  d->at = 0;
}
