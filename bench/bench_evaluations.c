/* SPDX-License-Identifier: BSD-3-Clause */
/* ns of one evaluation of a right-hand side, back to back over states of the motion: by parts, and by the one program
 * that the formulation writes; ms of making that; and ns of a lane where the solved program runs in 4 and 8 lanes. */
#include "bench.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/programs/saddle_program.h"
#include "followed_motion.h"
#include "integrators/formulations/formulation.h"
#include "integrators/run/methods.h"
#include "tests/solved_lanes.h"

enum { MANY = 5000 };

/* -- formulations -------------------------------------------------------------------------------------- */

/* A formulation at the first state, with articulated bodies where the system has them. */
typedef struct way {
    kmp_evaluator *eval;
    kmp_partition part;
    kmp_formulation *formulation;
    double *y, *dy; /* STATES x size, size */
    double made;    /* s */
} way;

/* The formulation refers to the partition in *w. */
static void make(way *w, const bench *b, const motion *m, const char *formulation, const char *form, bool brief)
{
    const kempe_system *s = b->system;
    const kmp_formulation_kind *kind = kmp_formulation_find(formulation, form);
    *w = (way){.eval = kmp_eval_new(s, "native")};
    if (kmp_eval_add_articulated(w->eval) != KEMPE_OK)
        bench_fail(b, formulation);
    kmp_eval_set_by_bodies(w->eval, kind->by_bodies);
    kmp_eval_closure(w->eval, m->t[0], m->q);
    kmp_eval_freeze(w->eval, m->t[0], m->q, m->qd);
    if (kmp_partition_init(&w->part, s, w->eval->jacobian, NULL, 0) != KEMPE_OK)
        bench_fail(b, formulation);
    const kmp_formulation_start start = {.system = s,
                                         .eval = w->eval,
                                         .part = &w->part,
                                         .t = m->t[0],
                                         .q = m->q,
                                         .qd = m->qd,
                                         .rtol = 1e-8,
                                         .atol = 1e-8,
                                         .rate_scale = 1,
                                         .brief = brief};
    double from = bench_now();
    w->formulation = kind->create(kind, &start);
    w->made = bench_now() - from;
    if (!w->formulation)
        bench_fail(b, formulation);
    size_t size = (size_t)w->formulation->size, n = (size_t)m->n;
    w->y = calloc((STATES + 1) * size, sizeof *w->y);
    w->dy = w->y + STATES * size;
    for (int k = 0; k < m->count; k++)
        if (w->formulation->resume(w->formulation, m->t[k], m->q + (size_t)k * n, m->qd + (size_t)k * n,
                                   w->y + (size_t)k * size, NULL) != KMP_GO)
            bench_fail(b, formulation);
}

/* Evaluates until the formulation makes its program, if it has not yet. */
static void renew(way *w, const motion *m)
{
    kmp_formulation *f = w->formulation;
    for (int k = 0; k < MANY; k++)
        (void)f->ode.rhs(f->ode.self, m->t[0], w->y, w->dy);
    double from = bench_now();
    if (f->renew)
        (void)f->renew(f, m->t[0], w->y, NULL);
    w->made += bench_now() - from;
}

static void drop(way *w)
{
    w->formulation->release(w->formulation);
    kmp_partition_free(&w->part);
    kmp_eval_free(w->eval);
    free(w->y);
}

typedef struct evaluated {
    const way *w;
    const motion *m;
} evaluated;

static void evaluate_once(void *self, int k)
{
    const evaluated *e = self;
    const kmp_ode *ode = &e->w->formulation->ode;
    int at = k % e->m->count;
    (void)ode->rhs(ode->self, e->m->t[at], e->w->y + at * e->w->formulation->size, e->w->dy);
}

static double time_of(const way *w, const motion *m)
{
    evaluated e = {w, m};
    return least_time(evaluate_once, &e);
}

static void measure(const bench *b, const motion *m, const char *formulation, const char *form)
{
    way parts, one;
    make(&parts, b, m, formulation, form, true);
    make(&one, b, m, formulation, form, false);
    renew(&one, m);
    double before = INFINITY, after = INFINITY;
    for (int round = 0; round < 3; round++) {
        before = fmin(before, time_of(&parts, m));
        after = fmin(after, time_of(&one, m));
    }
    printf("  %-10s %-10s %8.0f %8.0f %6.2f  %8.2f\n", formulation, form ? form : "", before, after, before / after,
           1e3 * (one.made - parts.made));
    drop(&parts);
    drop(&one);
}

/* -- lanes --------------------------------------------------------------------------------------------- */

static void run_lanes_once(void *self, int k)
{
    (void)k;
    (void)kmp_lanes_run(self, KMP_SADDLE_PROGRAM_RUN);
}

/* Returns ns of a run of the solved program in lanes. */
static double time_of_lanes(const kmp_saddle_program *solved, const kmp_evaluator *eval, const motion *m, int width)
{
    kmp_lanes *lanes = solved_lanes(solved, eval, width);
    for (int lane = 0; lane < width; lane++) {
        kmp_lanes_set_one(lanes, KMP_IN_TIME, lane, &m->t[lane]);
        kmp_lanes_set_one(lanes, KMP_IN_Q, lane, m->q + lane * m->n);
        kmp_lanes_set_one(lanes, KMP_IN_QD, lane, m->qd + lane * m->n);
    }
    double best = least_time(run_lanes_once, lanes);
    kmp_lanes_free(lanes);
    return best;
}

static void measure_lanes(const bench *b, const motion *m)
{
    way w;
    make(&w, b, m, "projected", NULL, true);
    kmp_saddle_program *solved = NULL;
    if (kmp_saddle_program_new(&solved, w.eval, &w.part) != KEMPE_OK)
        bench_fail(b, "solved");
    if (solved)
        printf("  solved program%s: %ld operations; all lanes of 1 %.0f, of 4 %.0f, of 8 %.0f ns\n",
               kmp_saddle_program_layout_of(solved)->by_bodies ? " by articulated bodies" : "",
               kmp_saddle_program_count(solved).paper, time_of_lanes(solved, w.eval, m, 1),
               time_of_lanes(solved, w.eval, m, 4), time_of_lanes(solved, w.eval, m, 8));
    kmp_saddle_program_free(solved);
    drop(&w);
}

int bench_evaluations(int count, char **paths)
{
    static const char *const usual[] = {"examples/four_bar/four_bar.yaml",
                                        "examples/andrews/andrews.yaml",
                                        "examples/double_wishbone/double_wishbone.yaml",
                                        "examples/stewart/stewart.yaml",
                                        "examples/suspension/suspension.yaml",
                                        "examples/n_four_bar/n_four_bar_40.yaml",
                                        "examples/limousine/limousine.yaml"};
    int models = count > 1 ? count - 1 : (int)(sizeof usual / sizeof *usual);
    printf("formulation             by parts   as one  ratio  ms to make\n");
    for (int k = 0; k < models; k++) {
        const char *path = count > 1 ? paths[k + 1] : usual[k];
        bench b = bench_load(path);
        motion m = motion_follow(&b, path);
        printf("%s: n %d, m %d\n", path, b.system->n, b.system->m);
        measure(&b, &m, "projected", NULL);
        measure(&b, &m, "reduced", "integrated");
        measure(&b, &m, "reduced", "newton");
        measure_lanes(&b, &m);
        free(m.q);
        bench_free(&b);
    }
    return 0;
}
