/* SPDX-License-Identifier: BSD-3-Clause */
/* Driver for explicit Runge-Kutta methods: first step, attempts, step-size control, acceptance by the formulation,
 * dense output on demand. Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, 2nd ed., II.4; Hairer,
 * Wanner, II, IV.2. */
#include "integrators/steppers/rk.h"
#include "integrators/decide/run_start.h"
#include <string.h>

/* -- creation -------------------------------------------------------------------------------------- */

static void make_room(kmp_rk *s, const kmp_rk_method *method, kmp_arena *a)
{
    int n = s->base.ode.n;
    (void)KMP_ARENA_MAKE(a, KMP_ROOM(double, n, &s->y, &s->y_old, &s->stage, &s->w));
    for (int i = 1; i <= method->numbers.stages; i++)
        s->k[i] = KMP_ARENA_NEW(a, double, n);
    for (int i = 0; i < method->numbers.interpolants; i++)
        s->interpolant[i] = KMP_ARENA_NEW(a, double, n);
    s->method = method;
    s->dy = s->k[method->numbers.end];
}

void *kmp_rk_create(const kmp_solver_kind *kind, const kmp_solver_setup *setup)
{
    kmp_rk *s = kmp_solver_new(kind, setup, sizeof *s);
    if (!s)
        return NULL;
    make_room(s, kind->method, &s->base.arena);
    /* A solver of the same problem, whose steps the formulation neither corrects nor rejects. */
    kmp_rk *finer = s->finer = KMP_ARENA_NEW(&s->base.arena, kmp_rk, 1);
    if (finer) {
        finer->base.context = s->base.context;
        finer->base.tolerance = s->base.tolerance;
        finer->base.ode = s->base.ode;
        finer->base.ode.accept = NULL;
        make_room(finer, s->method, &s->base.arena);
    }
    return kmp_solver_made(s);
}

/* -- start ----------------------------------------------------------------------------------------- */

static int choose_first_step(kmp_rk *s)
{
    int n = s->base.ode.n;
    double longest = s->base.t_end - s->base.t;
    for (int i = 0; i < n; i++)
        s->w[i] = s->base.tolerance.atol[i] + s->base.tolerance.rtol * fabs(s->y[i]);
    double slope = kmp_start_square(n, 1, s->dy, NULL, s->w), size = kmp_start_square(n, 1, s->y, NULL, s->w);
    double h = kmp_start_euler(slope, size, longest);
    int said = kmp_solver_euler(&s->base, &h, s->y, s->dy, s->stage, s->k[2]);
    double change = kmp_start_square(n, 1, s->k[2], s->dy, s->w);
    s->base.h = kmp_start_step(h, fmax(sqrt(change) / h, sqrt(slope)), s->method->numbers.order, longest);
    return said == KMP_HALT ? KMP_HALT : KMP_GO;
}

kempe_status kmp_rk_start(void *solver, double t, const double *y, const double *yp, double t_end, double h0)
{
    kmp_rk *s = solver;
    (void)yp;
    kmp_solver_begin(&s->base, t, t_end, h0);
    s->error_old = KMP_RK_ERROR_FLOOR;
    s->rejected = s->dense_ready = s->collapsed = false;
    s->dy = s->k[s->method->numbers.end];
    memcpy(s->y, y, (size_t)s->base.ode.n * sizeof *y);
    int said = kmp_solver_call(&s->base, t, s->y, s->dy);
    if (said == KMP_GO && h0 == 0.0 && t_end > t)
        said = choose_first_step(s);
    return said == KMP_GO ? KEMPE_OK : KEMPE_E_FAILED;
}

/* -- one attempt ----------------------------------------------------------------------------------- */

/* Makes stages, error test, derivative at the end, and asks the formulation. The new y is left in y_old. */
static kmp_attempt attempt(kmp_rk *s, double h, double t_new, double *error)
{
    const kmp_rk_method *method = s->method;
    int said = method->run(s, h, t_new);
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_ATTEMPT_BAD_STAGE : KMP_ATTEMPT_NONE;
    *error = method->error(s, h);
    if (!kmp_step_passes(*error, s->base.fixed > 0))
        return KMP_ATTEMPT_BAD_ERROR;
    if (!method->ends_with_derivative)
        said = kmp_solver_call(&s->base, t_new, s->y_old, s->k[method->numbers.end]);
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_ATTEMPT_BAD_STAGE : KMP_ATTEMPT_NONE;
    said = s->base.ode.accept ? s->base.ode.accept(s->base.ode.self, t_new, s->y_old, s->k[method->numbers.end], s->w)
                              : KMP_GO;
    if (said != KMP_GO)
        return said == KMP_RETRY ? KMP_ATTEMPT_BAD_STEP : KMP_ATTEMPT_NONE;
    return KMP_ATTEMPT_TAKEN;
}

/* -- step-size control ------------------------------------------------------------------------------ */

kempe_status kmp_rk_step(void *solver)
{
    kmp_rk *s = solver;
    s->base.t_old = s->base.t;
    s->dense_ready = false;
    if (!(s->base.t < s->base.t_end))
        return KEMPE_OK;
    if (s->dy == s->k[s->method->numbers.end]) {
        kmp_solver_swap(&s->k[1], &s->k[s->method->numbers.end]);
        s->dy = s->k[1];
    }
    for (int tries = 0; tries < KMP_STEP_ATTEMPTS; tries++) {
        double t_new = s->base.t, error = 0.0;
        double h = kmp_step_to_try(tries, s->base.t, s->base.t_end, s->base.h, s->base.fixed, &t_new);
        if (!(h > 0) || s->collapsed)
            break;
        const kmp_attempt what = attempt(s, h, t_new, &error);
        if (what == KMP_ATTEMPT_NONE)
            break;
        s->base.h = kmp_step_after(&s->method->numbers, what, h, error, s->error_old, s->rejected);
        s->rejected = what != KMP_ATTEMPT_TAKEN;
        if (!s->rejected) {
            s->collapsed = kmp_step_collapsed(&s->base.hopeless, h, t_new);
            s->base.work.steps++;
            s->error_old = kmp_step_known_error(error);
            s->taken = h;
            s->base.t = t_new;
            s->dy = s->k[s->method->numbers.end];
            kmp_solver_swap(&s->y, &s->y_old);
            return KEMPE_OK;
        }
        s->base.work.rejected += what == KMP_ATTEMPT_BAD_ERROR;
        s->base.work.refused += what != KMP_ATTEMPT_BAD_ERROR;
    }
    return KEMPE_E_FAILED;
}

void kmp_rk_undo(void *solver, double h)
{
    kmp_rk *s = solver;
    if (!kmp_solver_take_back(&s->base, h))
        return;
    kmp_solver_swap(&s->y, &s->y_old);
    s->dy = s->k[1];
    s->error_old = KMP_RK_ERROR_FLOOR;
    s->rejected = s->dense_ready = s->collapsed = false;
}

/* -- dense output ---------------------------------------------------------------------------------- */

void kmp_rk_begin_dense(kmp_rk *s)
{
    kmp_rk_cubics(s->base.ode.n, 1, s->taken, s->y_old, s->y, s->k[1], s->k[s->method->numbers.end], s->interpolant);
}

static bool prepare(kmp_rk *s)
{
    if (s->dense_ready || s->received || s->method->prepare_dense(s) != KMP_GO)
        return s->dense_ready;
    s->dense_ready = true;
    const int vectors = s->method->numbers.interpolants;
    s->coarse =
        !(s->base.fixed > 0) && kmp_rk_is_coarse(s->base.ode.n, vectors, s->interpolant[vectors - 1], 1, s->w, 1);
    return true;
}

/* The solution at t within the last step by further steps from its beginning. False: these cannot be made. Their
 * cycles are not counted: a choice of the integrator, which judges by them, would depend on the rows. */
static bool integrate(kmp_rk *s, double t, double *y)
{
    kmp_rk *f = s->finer;
    long rhs = f->base.work.rhs;
    bool goes = kmp_rk_start(f, s->base.t_old, s->y_old, NULL, t, t - s->base.t_old) == KEMPE_OK;
    for (int k = 0; goes && f->base.t < t && k < KMP_STEP_FINER; k++)
        goes = kmp_rk_step(f) == KEMPE_OK;
    s->base.work.rhs += f->base.work.rhs - rhs;
    goes = goes && f->base.t == t;
    if (goes)
        memcpy(y, f->y, (size_t)s->base.ode.n * sizeof *y);
    return goes;
}

kempe_status kmp_rk_dense(void *solver, double t, double *y, double *yp)
{
    kmp_rk *s = solver;
    (void)yp;
    bool at_end = t == s->base.t || !(s->base.t > s->base.t_old); /* no step yet, or the last one failed */
    if (at_end || !(t > s->base.t_old)) {                         /* needs no stages, which may fail */
        memcpy(y, at_end ? s->y : s->y_old, (size_t)s->base.ode.n * sizeof *y);
        return KEMPE_OK;
    }
    if (!prepare(s))
        return KEMPE_E_FAILED;
    if (s->coarse && integrate(s, t, y))
        return KEMPE_OK;
    kmp_rk_interpolate(s->base.ode.n, s->method->numbers.interpolants, s->interpolant, (t - s->base.t_old) / s->taken,
                       y);
    return KEMPE_OK;
}

void kmp_rk_transfer(void *solver, kmp_number_stream *stream)
{
    kmp_rk *s = solver;
    int n = s->base.ode.n;
    kmp_solver_transfer_times(&s->base, stream);
    s->received = stream->back;
    double ready = !stream->back && s->base.t > s->base.t_old && prepare(s);
    kmp_stream_numbers(stream, 1, &ready);
    s->dense_ready = ready > 0;
    double coarse = s->coarse;
    kmp_stream_numbers(stream, 1, &coarse);
    s->coarse = coarse > 0;
    kmp_stream_numbers(stream, 1, &s->taken);
    kmp_stream_numbers(stream, n, s->y);
    kmp_stream_numbers(stream, n, s->y_old);
    for (int j = 0; s->dense_ready && j < s->method->numbers.interpolants; j++)
        kmp_stream_numbers(stream, n, s->interpolant[j]);
}
