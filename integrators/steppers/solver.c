/* SPDX-License-Identifier: BSD-3-Clause */
/* Integrators as rows of integrators.def, and what all share: counts of calls, the time of the last steps, and the
 * first step by the size of the second derivative (Hairer, Norsett and Wanner, Solving Ordinary Differential Equations
 * I, II.4). */
#include "integrators/steppers/solver.h"
#include "base/memory.h"
#include "integrators/decide/run_start.h"
#include <float.h>
#include <math.h>
#include <string.h>

static const kmp_solver_kind *const kinds[] = {
#define KMP_SOLVER(name) &kmp_solver_##name,
#include "integrators/steppers/integrators.def"
#undef KMP_SOLVER
};

const kmp_solver_kind *kmp_solver_get(int k)
{
    return k >= 0 && k < (int)(sizeof kinds / sizeof *kinds) ? kinds[k] : NULL;
}

const kmp_solver_kind *kmp_solver_find(const char *name)
{
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++)
        if (strcmp(kinds[k]->name, name) == 0)
            return kinds[k];
    return NULL;
}

void *kmp_solver_new(const kmp_solver_kind *kind, const kmp_solver_setup *setup, size_t bytes)
{
    kmp_solver *solver = kmp_calloc(1, bytes);
    if (!solver) {
        (void)kmp_fail_memory(setup->context);
        return NULL;
    }
    solver->context = setup->context;
    solver->tolerance = setup->tolerance;
    solver->fixed = setup->fixed_step;
    if (kind->dae)
        solver->dae = *setup->dae;
    else
        solver->ode = *setup->ode;
    return solver;
}

void kmp_solver_free(void *solver)
{
    if (solver)
        kmp_arena_free(&((kmp_solver *)solver)->arena);
    kmp_free(solver);
}

void *kmp_solver_made(void *solver)
{
    kmp_solver *s = solver;
    if (!s->arena.failed)
        return s;
    (void)kmp_fail_memory(s->context);
    kmp_solver_free(s);
    return NULL;
}

void kmp_solver_begin(kmp_solver *solver, double t, double t_end, double h)
{
    solver->t = solver->t_old = t;
    solver->t_end = t_end;
    solver->h = h;
    solver->hopeless = 0;
}

bool kmp_solver_take_back(kmp_solver *solver, double h)
{
    if (!(solver->t > solver->t_old))
        return false;
    solver->t = solver->t_old;
    solver->h = h;
    solver->work.steps--;
    solver->work.refused++;
    return true;
}

void kmp_solver_transfer_times(kmp_solver *solver, kmp_number_stream *stream)
{
    kmp_stream_numbers(stream, 1, &solver->t);
    kmp_stream_numbers(stream, 1, &solver->t_old);
}

int kmp_solver_call(kmp_solver *solver, double t, const double *y, double *dy)
{
    solver->work.rhs++;
    solver->cycles += solver->ode.cycles + KMP_CYCLES_OF_STAGE + KMP_CYCLES_OF_UNKNOWN * solver->ode.n;
    return solver->ode.rhs(solver->ode.self, t, y, dy);
}

/* f near (t, y), of only a motion where equations follow it: their slopes remain the slopes of dy. */
static int call_near(kmp_solver *solver, double t, const double *y, const double *dy, double *f)
{
    const kmp_ode *ode = &solver->ode;
    if (ode->followers == 0)
        return kmp_solver_call(solver, t, y, f);
    solver->work.rhs++;
    memcpy(f, dy, (size_t)ode->n * sizeof *f);
    return ode->alone(ode->self, t, y, f);
}

int kmp_solver_euler(kmp_solver *solver, double *h, const double *y, const double *dy, double *y1, double *f)
{
    int said = KMP_RETRY;
    for (int attempt = 0; said == KMP_RETRY && attempt < KMP_START_EULERS; attempt++) {
        *h = attempt ? *h / 4 : *h;
        for (int i = 0; i < solver->ode.n; i++)
            y1[i] = y[i] + *h * dy[i];
        said = call_near(solver, solver->t + *h, y1, dy, f);
        solver->work.refused += said == KMP_RETRY;
    }
    return said;
}

/* Norm of (a - b) in the weights; b NULL: of a. */
static double norm(int n, const double *a, const double *b, const double *scale)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        double e = (b ? a[i] - b[i] : a[i]) / scale[i];
        sum += e * e;
    }
    return sqrt(sum / n);
}

int kmp_solver_first_step(kmp_solver *solver, int order, const double *y, const double *dy, const double *scale,
                          double *y1, double *f)
{
    int n = solver->ode.n;
    double longest = solver->t_end - solver->t, slope = norm(n, dy, NULL, scale), size = norm(n, y, NULL, scale);
    double h = fmin(slope <= 1e-5 || size <= 1e-5 ? 1e-6 : 0.01 * size / slope, longest);
    int said = kmp_solver_euler(solver, &h, y, dy, y1, f);
    double most = fmax(said == KMP_GO ? norm(n, f, dy, scale) / h : 0, slope);
    solver->h = kmp_start_step(h, most, order, longest);
    return said == KMP_HALT ? KMP_HALT : KMP_GO;
}

const char *kmp_solver_family(const char *name)
{
    const kmp_solver_kind *kind = kmp_solver_find(name);
    return kind && kind->family ? kind->family : name;
}
