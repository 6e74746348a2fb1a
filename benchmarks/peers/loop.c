/* Classical Runge-Kutta steps of one mode over the table above. See c_loop.py. */

typedef struct {
  double alpha, foot;
} Motion;

static inline void evaluate(int function, int piece, double u, double *value, double *slope) {
  double v = TABLE[function][POWERS - 1][piece], s = 0.0;
  for (int k = POWERS - 2; k >= 0; k--) {
    s = s * u + v;
    v = v * u + TABLE[function][k][piece];
  }
  *value = v;
  *slope = s * (2.0 * SCALE);
}

/* MODEL 1.4: sticking, or sliding backwards (friction forwards, mode -1). */
static inline Motion motion(double theta, double rate, double torque) {
  double place = (theta - START) * SCALE;
  int piece = (int)place;
  piece = piece < 0 ? 0 : piece > PIECES - 1 ? PIECES - 1 : piece;
  double u = 2.0 * (place - piece) - 1.0;
  double M, dM, Y, dY, square = rate * rate;
  evaluate(0, piece, u, &M, &dM);
  evaluate(2, piece, u, &Y, &dY);
  double drive = torque - dM * square / 2.0 - GRAVITY * Y;
#if SLIDES
  double P, dP;
  evaluate(1, piece, u, &P, &dP);
  double coupling = P - FRICTION * Y;
  double drag = -dP * square + FRICTION * (MASS * GRAVITY + dY * square);
  double scale = 1.0 / (M * MASS - P * coupling);
  Motion found = {scale * (MASS * drive - P * drag), scale * (M * drag - coupling * drive)};
#else
  Motion found = {drive / M, 0.0};
#endif
  return found;
}

/* `steps` steps of `dt` for every member; members is a multiple of BLOCK. */
void walk(long members, long steps, double dt, const double *restrict torque,
          double *restrict theta, double *restrict rate, double *restrict slide,
          double *restrict velocity) {
  for (long first = 0; first < members; first += BLOCK) {
    double angle[BLOCK], speed[BLOCK], place[BLOCK], foot[BLOCK], drive[BLOCK];
    for (int i = 0; i < BLOCK; i++) {
      angle[i] = theta[first + i], speed[i] = rate[first + i], drive[i] = torque[first + i];
      place[i] = slide[first + i], foot[i] = velocity[first + i];
    }
    for (long step = 0; step < steps; step++) {
#pragma GCC ivdep
      for (int i = 0; i < BLOCK; i++) {
        double q = angle[i], w = speed[i], T = drive[i];
        Motion a = motion(q, w, T);
        double w2 = w + dt / 2.0 * a.alpha;
        Motion b = motion(q + dt / 2.0 * w, w2, T);
        double w3 = w + dt / 2.0 * b.alpha;
        Motion c = motion(q + dt / 2.0 * w2, w3, T);
        double w4 = w + dt * c.alpha;
        Motion d = motion(q + dt * w3, w4, T);
        angle[i] = q + dt / 6.0 * (w + 2.0 * w2 + 2.0 * w3 + w4);
        speed[i] = w + dt / 6.0 * (a.alpha + 2.0 * b.alpha + 2.0 * c.alpha + d.alpha);
#if SLIDES
        place[i] += dt * (foot[i] + dt / 6.0 * (a.foot + b.foot + c.foot));
        foot[i] += dt / 6.0 * (a.foot + 2.0 * b.foot + 2.0 * c.foot + d.foot);
#endif
      }
    }
    for (int i = 0; i < BLOCK; i++) {
      theta[first + i] = angle[i], rate[first + i] = speed[i];
      slide[first + i] = place[i], velocity[first + i] = foot[i];
    }
  }
}
