/* SPDX-License-Identifier: BSD-3-Clause */
/* Accelerations and multipliers of the solved program against the dense saddle system, at states along the motion of
 * examples; its lanes against its scalar code, to the last bit. */
#include "constraints/closing/saddle.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/programs/load_passes.h"
#include "constraints/programs/reduced_program.h"
#include "constraints/programs/saddle_program.h"
#include "random.h"
#include "states.h"
#include "testing.h"
#include "tests/solved_lanes.h"

enum { STATES = 4 };

typedef struct example {
    const char *name;
    bool by_bodies, forced; /* by articulated bodies; with a user-defined force */
    bool loaded;            /* in tests/models: with forces that depend on multipliers */
} example;

/* Trees and loops, redundant rows, drives, damping, charts, efforts, friction by loads. */
static const example examples[] = {{"andrews/andrews", false, false, false},
                                   {"four_bar/four_bar", false, false, false},
                                   {"n_four_bar/n_four_bar_40", false, false, false},
                                   {"bricard/bricard", false, false, false},
                                   {"stewart/stewart", false, false, false},
                                   {"governor/governor", false, false, false},
                                   {"double_wishbone/double_wishbone", false, false, false},
                                   {"bennett/bennett", false, false, false},
                                   {"peaucellier/peaucellier", false, false, false},
                                   {"parallel_robot/parallel_robot_spatial", false, false, false},
                                   {"n_four_bar_spatial/n_four_bar_spatial", false, false, false},
                                   {"slider_crank_spatial/slider_crank_spatial", false, false, false},
                                   {"driven_slider_crank/driven_slider_crank", false, false, false},
                                   {"suspension/suspension", false, false, false},
                                   {"suspension/suspension", true, false, false},
                                   {"limousine/limousine", false, false, false},
                                   {"limousine/limousine", true, false, false},
                                   {"governor/governor", true, false, false},
                                   {"stewart/stewart", true, false, false},
                                   {"four_bar/four_bar", false, true, false},
                                   {"governor/governor", true, true, false},
                                   {"friction_five_bar", false, false, true},
                                   {"friction_five_bar", false, true, true},
                                   {"guide_friction_carrier", false, false, true},
                                   {"rubbing_pin", false, false, true},
                                   {"guide_friction", false, false, true}};

/* A force that depends on all of t, q and qd. */
static int push(void *user, double t, const double *q, const double *qd, double *effort)
{
    int n = *(const int *)user;
    for (int i = 0; i < n; i++)
        effort[i] = 1e-2 * (t + q[i] - qd[(i + 1) % n]);
    return 0;
}

typedef struct bench {
    kmp_evaluator *eval; /* of the solved program */
    kmp_evaluator *by_mass;
    kmp_partition part;
    kmp_saddle saddle;
    kmp_saddle_program *solved;
    kmp_reduction red;
    kmp_reduced_program *reduced; /* of a state (u, ud, v); NULL: user-defined forces and multipliers of forces */
    const kmp_saddle_program_layout *layout;
    double *violation, *lambda;  /* m */
    double *qdd, *dx, *expected; /* n */
} bench;

static bool prepare(bench *b, const kempe_system *s, const states *at, bool by_bodies)
{
    *b = (bench){.eval = kmp_eval_new(s, "native"), .by_mass = kmp_eval_new(s, "tape")};
    if (by_bodies) {
        CHECK(kmp_eval_add_articulated(b->eval) == KEMPE_OK && b->eval->bodies.machine);
        kmp_eval_set_by_bodies(b->eval, true);
    }
    kmp_eval_closure(b->eval, at->t[0], at->q);
    kmp_eval_closure(b->by_mass, at->t[0], at->q);
    CHECK(kmp_partition_init(&b->part, s, b->eval->jacobian, NULL, 0) == KEMPE_OK);
    CHECK(kmp_saddle_init(&b->saddle, b->by_mass, &b->part));
    kmp_eval_freeze(b->eval, at->t[0], at->q, at->qd);
    kmp_eval_freeze(b->by_mass, at->t[0], at->q, at->qd);
    CHECK(kmp_saddle_program_new(&b->solved, b->eval, &b->part) == KEMPE_OK && b->solved);
    kmp_eval_closure(b->eval, at->t[0], at->q);
    CHECK(kmp_reduction_init(&b->red, b->eval, &b->part) == KEMPE_OK && kmp_reduction_factor(&b->red) == 0);
    CHECK(kmp_reduced_program_new_by_saddle(&b->reduced, &b->red, false) == KEMPE_OK);
    CHECK(!b->reduced == (s->load_row_count > 0 && s->force));
    if (!b->solved)
        return false;
    b->layout = kmp_saddle_program_layout_of(b->solved);
    CHECK(b->layout->by_bodies == by_bodies);
    b->violation = KMP_NEW(double, 2 * s->m + 3 * s->n);
    b->lambda = b->violation + s->m;
    b->qdd = b->lambda + s->m;
    b->dx = b->qdd + s->n;
    b->expected = b->dx + s->n;
    return true;
}

static void finish(bench *b)
{
    kmp_saddle_program_free(b->solved);
    kmp_reduced_program_free(b->reduced);
    kmp_reduction_free(&b->red);
    kmp_saddle_free(&b->saddle);
    kmp_partition_free(&b->part);
    kmp_eval_free(b->eval);
    kmp_eval_free(b->by_mass);
    kmp_free(b->violation);
}

/* The stage END, lent to the evaluator. */
static double difference_at_end(bench *b, double t, const double *q)
{
    const kempe_system *s = b->eval->system;
    double worst = 0;
    kmp_saddle_program_lend(b->solved, t, q);
    for (int k = 0; k < s->m; k++)
        worst = check_max(worst, fabs(b->eval->h[k] - b->by_mass->h[k]) / s->row_scale[k]);
    worst = check_max(worst, check_apart(s->jacobian.count, b->eval->jacobian, b->by_mass->jacobian));
    CHECK(!b->eval->h_t == !b->by_mass->h_t);
    return b->eval->h_t ? check_max(worst, check_apart(s->m, b->eval->h_t, b->by_mass->h_t)) : worst;
}

/* Accelerations with the loops open: M qdd + C, beside C. By bodies: what no multiplier makes of them, all on a tree.
 */
static double difference_of_open(bench *b, const double *open)
{
    const kempe_system *s = b->eval->system;
    double off = 0, size = 1e-300;
    for (int i = 0; b->layout->by_bodies && b->layout->r > 0 && i < s->n; i++)
        off = isfinite(open[i]) ? off : INFINITY;
    if (b->layout->by_bodies && b->layout->r > 0)
        return off;
    memcpy(b->dx, b->by_mass->bias, (size_t)s->n * sizeof *b->dx);
    kmp_eval_add_mass_times(b->by_mass, open, b->dx);
    for (int i = 0; i < s->n; i++) {
        off = check_max(off, fabs(b->dx[i]));
        size = check_max(size, fabs(b->by_mass->bias[i]));
    }
    return off / size;
}

/* The stage CORRECT, for a violation of all rows. */
static double difference_of_corrections(bench *b)
{
    const kempe_system *s = b->eval->system;
    for (int k = 0; k < s->m; k++)
        b->violation[k] = between(-1, 1) * s->row_scale[k];
    kmp_saddle_program_correct(b->solved, b->violation, b->dx);
    kmp_saddle_solve(&b->saddle, NULL, b->violation, b->expected, NULL);
    return check_apart(s->n, b->dx, b->expected);
}

/* Difference of accelerations, beside those of each coordinate alone and the squares of rates, which may cancel. */
static double apart_of_accelerations(const bench *b, const double *qdd, const double *qd)
{
    const kmp_pattern *mass = &b->eval->system->mass;
    double off = 0, size = 1e-300;
    for (int k = 0; k < mass->count; k++)
        if (mass->row[k] == mass->col[k]) {
            int i = mass->row[k];
            off = check_max(off, fabs(qdd[i] - b->qdd[i]));
            size = check_max(size, fabs(b->by_mass->bias[i] / b->by_mass->mass[k]));
            size = check_max(size, check_max(fabs(b->qdd[i]), qd[i] * qd[i]));
        }
    return off / size;
}

/* The power of forces and of moving closures, and the size of its terms, which may cancel. A multiplier is accurate to
 * the rounding of the largest one: that of a drive may be what remains of large ones. */
static double power_at(bench *b, double t, const double *q, const double *qd, double *size)
{
    const kempe_system *s = b->eval->system;
    double power = kmp_eval_power(b->by_mass, t, q, qd) + kmp_eval_drive_power(b->by_mass, b->lambda);
    double most = 0;
    *size = check_max(fabs(power), 1e-300);
    for (int k = 0; k < s->m; k++)
        most = check_max(most, fabs(b->lambda[k]));
    for (int i = 0; i < s->n; i++)
        *size += fabs(b->by_mass->bias[i] * qd[i]);
    for (int k = 0; b->by_mass->h_t && k < s->m; k++)
        *size += most * fabs(b->by_mass->h_t[k]);
    return power;
}

/* The right-hand side of a state, at rates that meet the closures. `size`: of the terms of the power. */
static double difference_of_state(bench *b, double t, const double *q, const double *qd, double power, double size)
{
    int p = b->part.p, r = b->part.r;
    double *y = KMP_NEW(double, 4 * p + 2 * r), *dy = y + 2 * p + r, own = 0, rates = 0, fastest = 1e-300;
    double *qdd = KMP_NEW(double, p + r);
    bool cancelled;
    for (int k = 0; k < p; k++) {
        y[k] = q[b->part.u[k]];
        y[p + k] = qd[b->part.u[k]];
    }
    for (int i = 0; i < r; i++)
        y[2 * p + i] = q[b->part.v[i]];
    CHECK(kmp_reduced_program_run(b->reduced, t, y, dy));
    own = b->layout->power >= 0 ? kmp_reduced_program_power(b->reduced) : 0;
    memcpy(qdd, b->qdd, (size_t)(p + r) * sizeof *qdd);
    for (int k = 0; k < p; k++) {
        CHECK(dy[k] == y[p + k]);
        qdd[b->part.u[k]] = dy[p + k];
    }
    for (int i = 0; i < r; i++) {
        rates = check_max(rates, fabs(dy[2 * p + i] - qd[b->part.v[i]]));
        fastest = check_max(fastest, fabs(qd[b->part.v[i]]));
    }
    double off = check_max(apart_of_accelerations(b, qdd, qd), rates / fastest);
    CHECK(fabs(own - power) <= 1e-9 * size);
    CHECK(kmp_reduced_program_lend(b->reduced, t, q, 1e-8, 1, &cancelled));
    off = check_max(off, check_apart(b->eval->system->jacobian.count, b->eval->jacobian, b->by_mass->jacobian));
    kmp_free(y);
    kmp_free(qdd);
    return off;
}

/* Largest differences at a state, each beside the largest number of its kind. */
static double difference(bench *b, double t, const double *q, const double *qd)
{
    const kempe_system *s = b->eval->system;
    const kmp_saddle_program_layout *l = b->layout;
    bool good;
    kmp_eval_closure(b->by_mass, t, q);
    kmp_eval_mass(b->by_mass);
    kmp_eval_bias(b->by_mass, qd);
    CHECK(kmp_saddle_factor(&b->saddle) == 0);
    kmp_saddle_accelerations(&b->saddle, b->qdd, b->lambda);
    for (int k = 0; b->eval->nu && k < s->m; k++) /* near the solution, as in a motion */
        b->eval->nu[k] = 1.1 * b->by_mass->nu[k];
    const double *out = kmp_saddle_program_run(b->solved, t, q, qd, &good);
    CHECK(good);
    CHECK(!b->eval->nu || check_apart(s->m, b->eval->nu, b->by_mass->nu) < 1e-11);
    double worst = apart_of_accelerations(b, out + l->qdd, qd), most = 0, off = 0, size = 0;
    for (int k = 0; k < l->r; k++) {
        most = check_max(most, fabs(b->lambda[b->part.rows[k]]));
        off = check_max(off, fabs(b->lambda[b->part.rows[k]] - out[l->lambda + k]));
    }
    worst = check_max(worst, l->r > 0 ? off / most : 0);
    CHECK((l->power >= 0) == s->dissipative);
    if (l->power >= 0) {
        double power = power_at(b, t, q, qd, &size);
        worst = check_max(worst, fabs(out[l->power] - power) / size);
    }
    double state = b->reduced ? difference_of_state(b, t, q, qd, l->power >= 0 ? out[l->power] : 0, size) : 0;
    CHECK(state < 1e-8); /* rates of the motion meet the closures to that */
    worst = check_max(worst, difference_at_end(b, t, q));
    worst = check_max(worst, difference_of_open(b, b->eval->h + l->open - l->h));
    return check_max(worst, difference_of_corrections(b));
}

/* -- lanes --------------------------------------------------------------------------------------------- */

static int bits_apart(int count, int width, int lane, const double *of_lanes, const double *of_one)
{
    int bad = 0;
    for (int k = 0; k < count; k++)
        bad += memcmp(&of_lanes[k * width + lane], &of_one[k], sizeof *of_one) != 0;
    return bad;
}

/* Solves for multipliers that forces depend on, where there are such forces, from `first` (m). */
static void settle_lanes(const bench *b, kmp_lanes *lanes, int width, const double *first)
{
    kmp_arena arena = {0};
    kmp_load_passes passes;
    if (b->eval->system->load_row_count == 0)
        return;
    CHECK(kmp_load_passes_init(&passes, &arena, b->eval->system, &b->part, (size_t)width));
    kmp_load_begin(&passes, first);
    CHECK(kmp_load_settle_lanes(&passes, lanes));
    kmp_arena_free(&arena);
}

/* Each lane at a state beside the given one. */
static void compare_lanes(bench *b, int width, double t, const double *q, const double *qd)
{
    const kempe_system *s = b->eval->system;
    int n = s->n, m = s->m, bad = 0, run = b->layout->diagonal + b->layout->pivots;
    int end = m + s->jacobian.count + (s->rheonomic ? m : 0);
    double times[KMP_LANES_MOST];
    double *x = KMP_NEW(double, KMP_LANES_MOST *(2 * n + m)), *xd = x + width * n, *mu = xd + width * n;
    double *first = KMP_NEW(double, m);
    for (int k = 0; b->eval->nu && k < m; k++)
        first[k] = b->eval->nu[k];
    kmp_lanes *lanes = solved_lanes(b->solved, b->eval, width);
    CHECK(lanes != NULL);
    for (int l = 0; l < width; l++) {
        times[l] = t + 1e-3 * l;
        kmp_lanes_set_one(lanes, KMP_IN_TIME, l, &times[l]);
        for (int i = 0; i < n; i++) {
            x[l * n + i] = q[i] + between(-1e-2, 1e-2);
            xd[l * n + i] = qd[i] + between(-1e-2, 1e-2);
        }
        for (int k = 0; k < m; k++)
            mu[l * m + k] = between(-1, 1);
        kmp_lanes_set_one(lanes, KMP_IN_Q, l, x + l * n);
        kmp_lanes_set_one(lanes, KMP_IN_QD, l, xd + l * n);
        kmp_lanes_set_one(lanes, KMP_IN_MU, l, mu + l * m);
        if (s->force) {
            kmp_system_effort(s, times[l], x + l * n, xd + l * n, b->dx);
            kmp_lanes_set_one(lanes, KMP_IN_EFFORT, l, b->dx);
        }
    }
    settle_lanes(b, lanes, width, first);
    const double *of_run = kmp_lanes_run(lanes, KMP_SADDLE_PROGRAM_RUN),
                 *of_end = kmp_lanes_run(lanes, KMP_SADDLE_PROGRAM_END);
    const double *of_correct = kmp_lanes_run(lanes, KMP_SADDLE_PROGRAM_CORRECT);
    for (int l = 0; l < width; l++) {
        bool good;
        if (b->eval->nu)
            memcpy(b->eval->nu, first, (size_t)m * sizeof *first);
        bad += bits_apart(run, width, l, of_run,
                          kmp_saddle_program_run(b->solved, times[l], x + l * n, xd + l * n, &good));
        CHECK(good == kmp_saddle_program_is_good(b->layout, of_run + l, width));
        kmp_saddle_program_lend(b->solved, times[l], x + l * n);
        bad += bits_apart(end, width, l, of_end, b->eval->h);
        kmp_saddle_program_correct(b->solved, mu + l * m, b->dx);
        bad += bits_apart(n, width, l, of_correct, b->dx);
    }
    CHECK(bad == 0);
    kmp_lanes_free(lanes);
    kmp_free(first);
    kmp_free(x);
}

static void put_states(kmp_lanes *lanes, int n, const double *t, const double *q, const double *qd)
{
    for (int l = 0; l < KMP_LANES_MOST; l++) {
        kmp_lanes_set_one(lanes, KMP_IN_TIME, l, t + l);
        kmp_lanes_set_one(lanes, KMP_IN_Q, l, q + l * n);
        kmp_lanes_set_one(lanes, KMP_IN_QD, l, qd + l * n);
    }
}

/* Accelerations, multipliers and power by factors of a state nearby, improved again and again, beside those by factors
 * of their own. */
static void improve_nearby(const bench *b, double t, const double *q, const double *qd)
{
    enum { W = KMP_LANES_MOST, TIMES = 12 };
    const kmp_saddle_program_layout *l = b->layout;
    int n = l->n, count = n + l->r + (l->power >= 0);
    double times[W], first = 0, last = 0;
    double *x = KMP_NEW(double, W *(2 * n + count)), *xd = x + W * n, *got = xd + W * n;
    kmp_program *program = NULL;
    CHECK(kmp_saddle_program_write_near(b->eval, &b->part, 1e9, &program) && program);
    kmp_lanes *lanes = solved_lanes(b->solved, b->eval, W), *near = program ? kmp_lanes_new(program, W, false) : NULL;
    CHECK(lanes && near);
    if (!near)
        return;
    renew_solved_lanes(b->eval, W, near);
    for (int k = 0; k < W * n; k++) {
        times[k / n] = t;
        x[k] = q[k % n];
        xd[k] = qd[k % n];
    }
    put_states(lanes, n, times, x, xd);
    const double *run = kmp_lanes_run(lanes, KMP_SADDLE_PROGRAM_RUN);
    memcpy(got, run + l->qdd * W, (size_t)(n * W) * sizeof *got);
    memcpy(got + n * W, run + l->lambda * W, (size_t)(l->r * W) * sizeof *got);
    kmp_lanes_set(near, KMP_IN_MU, kmp_lanes_run(lanes, KMP_SADDLE_PROGRAM_FACTORS));
    for (int k = 0; k < W * n; k++) {
        times[k / n] = t + 1e-3 * (k / n);
        x[k] += between(-1e-2, 1e-2);
        xd[k] += between(-1e-2, 1e-2);
    }
    put_states(lanes, n, times, x, xd);
    put_states(near, n, times, x, xd);
    run = kmp_lanes_run(lanes, KMP_SADDLE_PROGRAM_RUN) + l->qdd * W;
    first = check_max(check_apart(W * n, got, run), check_apart(W * l->r, got + n * W, run + n * W));
    for (int k = 0; k < TIMES; k++) {
        kmp_lanes_set(near, KMP_IN_QDD, got);
        kmp_lanes_set(near, KMP_IN_LAMBDA, got + n * W);
        memcpy(got, kmp_lanes_run(near, 1), (size_t)(count * W) * sizeof *got);
    }
    last = check_max(check_apart(W * n, got, run), check_apart(W * l->r, got + n * W, run + n * W));
    CHECK(first > 1e-6 && last < 1e-10);
    if (l->power >= 0)
        CHECK(check_apart(W, got + (n + l->r) * W, run + (l->power - l->qdd) * W) < 1e-8);
    printf("    by factors nearby, %ld operations: from %.1e to %.1e\n", kmp_program_count(program, 1, 1).paper, first,
           last);
    kmp_lanes_free(lanes);
    kmp_lanes_free(near);
    kmp_program_free(program);
    kmp_free(x);
}

/* -- examples ------------------------------------------------------------------------------------------ */

static void along_the_motion(const kempe_system *s, const states *at, const example *of)
{
    bench b;
    double worst = 0;
    if (prepare(&b, s, at, of->by_bodies)) {
        for (int k = 0; k < at->count; k++)
            worst = check_max(worst, difference(&b, at->t[k], at->q + k * at->n, at->qd + k * at->n));
        CHECK(worst < 1e-11);
        long parts = kmp_program_count(s->motion, 1, s->motion->stages - 1).paper;
        printf("  %-40s n %d r %d%s: %.1e, %ld operations, solved as one %ld\n", of->name, s->n, b.part.r,
               b.layout->by_bodies ? ", by bodies" : "", worst, parts, kmp_saddle_program_count(b.solved).paper);
        compare_lanes(&b, 4, at->t[1], at->q + at->n, at->qd + at->n);
        compare_lanes(&b, 8, at->t[1], at->q + at->n, at->qd + at->n);
        CHECK((b.layout->factors > 0) == !of->by_bodies);
        if (of->loaded) {
            kmp_program *nearby;
            CHECK(kmp_saddle_program_write_nearby(b.solved, &b.part, &nearby) == KEMPE_OK && !nearby);
        } else if (!of->by_bodies && !of->forced)
            improve_nearby(&b, at->t[1], at->q + at->n, at->qd + at->n);
    }
    finish(&b);
}

static void the_examples(void)
{
    for (size_t k = 0; k < sizeof examples / sizeof *examples; k++) {
        char path[512];
        (void)snprintf(path, sizeof path, "%s/%s.yaml", examples[k].loaded ? "tests/models" : "examples",
                       examples[k].name);
        loaded l = load(path);
        states at;
        if (examples[k].by_bodies) {
            kempe_system_free(l.system);
            CHECK(kempe_system_new_with_algorithm(l.model, "articulated", &l.system) == KEMPE_OK);
        }
        if (examples[k].forced)
            kempe_system_set_force(l.system, push, &l.system->n);
        if (l.system && follow(l.system, STATES, &at)) {
            along_the_motion(l.system, &at, &examples[k]);
            kmp_free(at.q);
        }
        unload(&l);
    }
}

int main(void)
{
    TEST(the_examples);
    return check_report();
}
