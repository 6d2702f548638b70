/* SPDX-License-Identifier: BSD-3-Clause */
/* The newton form closes the loops in every evaluation: from predicted v that are off, accelerations are those of the
 * closed state to a fraction of the tolerances, by the fused program, by the solved one and in separate parts. */
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/tolerances.h"
#include "integrators/formulations/reduced.h"
#include "integrators/formulations/reduced_programs.h"
#include "random.h"
#include "states.h"

enum { STATES = 6, TRIES = 20 };
#define TOLERANCE 1e-8

typedef enum way { FUSED, SOLVED, IN_PARTS } way;
static const char *const ways[] = {"fused", "solved", "in parts"};

/* The form at the first state. */
typedef struct form {
    kmp_evaluator *eval;
    kmp_rank_margin margin;
    kmp_partition part;
    kmp_reduced *reduced;
} form;

static bool make(form *f, const kempe_system *s, const states *at, way by)
{
    const kmp_formulation_kind *kind = &kmp_formulation_newton;
    *f = (form){.eval = kmp_eval_new(s, "native")};
    kmp_eval_closure(f->eval, at->t[0], at->q);
    kmp_eval_freeze(f->eval, at->t[0], at->q, at->qd);
    CHECK(kmp_partition_init(&f->part, s, f->eval->jacobian, NULL, 0) == KEMPE_OK);
    const kmp_formulation_start start = {.system = s,
                                         .eval = f->eval,
                                         .part = &f->part,
                                         .margin = &f->margin,
                                         .t = at->t[0],
                                         .q = at->q,
                                         .qd = at->qd,
                                         .rtol = TOLERANCE,
                                         .atol = TOLERANCE,
                                         .rate_scale = 1,
                                         .brief = by == IN_PARTS};
    f->reduced = (kmp_reduced *)kind->create(kind, &start);
    if (f->reduced && by == SOLVED) {
        f->reduced->use.due_saddle_program = 0; /* otherwise after as many evaluations as it saves */
        CHECK(kmp_reduced_solve(f->reduced, at->t[0]) == KMP_GO);
    }
    return f->reduced;
}

static void drop(form *f)
{
    if (f->reduced)
        f->reduced->formulation.release(&f->reduced->formulation);
    kmp_partition_free(&f->part);
    kmp_eval_free(f->eval);
}

/* Largest of x, relative to that of y. */
static double relative(int count, const double *x, const double *y)
{
    double worst = 0, most = 1e-300;
    for (int i = 0; i < count; i++) {
        worst = check_max(worst, fabs(x[i] - y[i]));
        most = check_max(most, fabs(y[i]));
    }
    return worst / most;
}

/* Opens the loops of a state, v off by at most `off` scales, and evaluates: the derivative's distance from that at the
 * closed state; and h, at the state where the evaluation ended, in *open. */
static double evaluate_open(form *f, const double *y, double off, double *open)
{
    kmp_reduced *d = f->reduced;
    const kempe_system *s = f->eval->system;
    int size = d->formulation.size;
    double *z = KMP_NEW(double, 4 * size), *exact = z + size, *dy = exact + size;
    memcpy(z, y, (size_t)size * sizeof *y);
    CHECK(kmp_reduced_rhs(d, f->reduced->t, z, exact) == KMP_GO);
    for (int i = 0; i < d->r; i++)
        z[2 * d->p + i] += off * between(-1, 1) * s->scale[d->part.v[i]];
    CHECK(kmp_reduced_rhs(d, f->reduced->t, z, dy) == KMP_GO);
    double worst = relative(size, dy, exact);
    for (int i = 0; (d->use.by_saddle_program || (d->programs.scalar && d->use.closed_by_program)) && i < d->r; i++)
        d->q[d->part.v[i]] = d->v[i];
    for (int k = 0; k < d->p; k++)
        d->q[d->part.u[k]] = y[k];
    kmp_eval_closure(f->eval, d->t, d->q);
    *open = check_max(*open, kmp_eval_residual(f->eval));
    kmp_free(z);
    return worst;
}

/* `gain`: bound of the slopes' change for a change of v, both relative. */
static void one_form(const char *name, const kempe_system *s, const states *at, way by, double gain)
{
    form f;
    double worst = 0, open = 0;
    if (!make(&f, s, at, by)) {
        CHECK(false);
        drop(&f);
        return;
    }
    kmp_formulation *formulation = &f.reduced->formulation;
    CHECK(formulation->size == 2 * f.reduced->p + f.reduced->r + s->dissipative);
    random_seed(7);
    for (int k = 0; k < at->count; k++) {
        CHECK(formulation->resume(formulation, at->t[k], at->q + k * at->n, at->qd + k * at->n, formulation->y, NULL) ==
              KMP_GO);
        for (int try = 0; try < TRIES; try++)
            worst = check_max(worst, evaluate_open(&f, formulation->y, pow(10, -2.5 - 0.5 * try), &open));
    }
    bool fused = f.reduced->programs.scalar && !kmp_reduced_has_saddle_program(f.reduced);
    way used = fused ? FUSED : f.reduced->use.by_saddle_program ? SOLVED : IN_PARTS;
    printf("  %-30s %s: slopes %.1e, |h| %.1e\n", name, ways[used], worst, open);
    CHECK(formulation->exchanges > 0 || used == by);
    CHECK(worst < gain * KMP_CORRECTION_IN_STAGE * TOLERANCE);
    CHECK(open < KMP_CLOSED);
    drop(&f);
}

static void by_two_ways(const char *name, way by, double gain)
{
    char path[512];
    snprintf(path, sizeof path, "examples/%s.yaml", name);
    loaded l = load(path);
    states at;
    if (l.system && follow(l.system, STATES, &at)) {
        one_form(name, l.system, &at, by, gain);
        one_form(name, l.system, &at, IN_PARTS, gain);
        kmp_free(at.q);
    }
    unload(&l);
}

static void loops_are_closed_in_every_evaluation(void)
{
    static const char *const names[] = {"andrews/andrews", "four_bar/four_bar", "stewart/stewart", "bricard/bricard",
                                        "slider_crank_spatial/slider_crank_spatial"};
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        by_two_ways(names[k], FUSED, 100);
    by_two_ways("suspension/suspension", SOLVED, 1000); /* stiff springs */
}

int main(void)
{
    TEST(loops_are_closed_in_every_evaluation);
    return check_report();
}
