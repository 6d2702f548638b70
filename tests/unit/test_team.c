/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* ctest: slow once 6 */
/* A team does every piece once and is done when it says so; equations in parts have the bits of those in one. */
#include "backend/prepared.h"
#include "base/memory.h"
#include "constraints/evaluation/evaluator.h"
#include "dynamics/motion.h"
#include "integrators/formulations/reduced.h"
#include "integrators/run/methods.h"
#include "integrators/run/runner.h"
#include "loaded.h"
#include "platform/platform.h"
#include "studies/simulate/trajectory.h"
#include <kempe/check.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <unistd.h>

/* -- the team ---------------------------------------------------------------------------------------- */

enum { PIECES = 40, ROUNDS = 20000 };

/* Not atomic: who asks sees what others did without. */
static void count_piece(void *self, int piece)
{
    long *count = self;
    count[piece]++;
}

static void each_piece_is_done_once(void)
{
    for (int threads = 0; threads <= 5; threads++) {
        kmp_team *team = kmp_team_new(threads);
        long count[PIECES] = {0}, expected[PIECES] = {0}, bad = 0;
        for (int round = 0; team && round < ROUNDS; round++) {
            int pieces = round % (PIECES + 1);
            kmp_team_run(team, pieces, count_piece, count);
            for (int k = 0; k < PIECES; k++) {
                expected[k] += k < pieces;
                bad += count[k] != expected[k];
            }
            if (round % 2000 == 0)
                (void)usleep(1000); /* they fall asleep, and are called */
        }
        CHECK(team != NULL);
        CHECK(bad == 0);
        kmp_team_free(team);
    }
    kmp_team_free(NULL);
}

/* A piece that is brought is done once, by the next shared call or at the end, and by one that does not share. */
static void brought_pieces_are_done_once(void)
{
    for (int threads = 1; threads <= 4; threads++) {
        kmp_team *team = kmp_team_new(threads);
        long count[PIECES] = {0}, expected = 0, brought = 0, bad = team == NULL;
        for (int round = 0; team && round < ROUNDS; round++) {
            int calls = round % 3;
            bool rests = kmp_team_rests(team);
            kmp_team_bring(team, count_piece, &brought);
            for (int call = 0; call < calls; call++)
                kmp_team_run(team, PIECES, count_piece, count);
            bad += brought != round + (threads > 1 && calls > 0 && !rests) && !(rests && calls > 1);
            kmp_team_settle(team);
            kmp_team_settle(team);
            expected += calls;
            bad += brought != round + 1;
        }
        for (int k = 0; k < PIECES; k++)
            bad += count[k] != expected;
        CHECK(bad == 0);
        kmp_team_free(team);
    }
}

typedef struct seats {
    kmp_team *team;
    atomic_int taken[3]; /* by thread */
    atomic_int bad;
} seats;

/* A thread's number belongs to one piece at a time. */
static void take_seat(void *self, int piece)
{
    seats *s = self;
    int thread = kmp_team_thread(s->team);
    (void)piece;
    if (thread < 0 || thread > 2 || atomic_fetch_add(&s->taken[thread], 1) != 0)
        atomic_fetch_add(&s->bad, 1);
    else
        (void)sched_yield();
    if (thread >= 0 && thread <= 2)
        atomic_fetch_sub(&s->taken[thread], 1);
}

static void threads_have_numbers_of_their_own(void)
{
    kmp_team *team = kmp_team_new(3), *other = kmp_team_new(2);
    seats s = {.team = team};
    for (int round = 0; team && round < 2000; round++)
        kmp_team_run(team, PIECES, take_seat, &s);
    CHECK(team && atomic_load(&s.bad) == 0);
    CHECK(kmp_team_thread(team) == 0 && kmp_team_thread(other) == 0);
    kmp_team_free(team);
    kmp_team_free(other);
}

enum { TEAMS = 20, CALLS = 20 };

typedef struct burden {
    double s[2];   /* of the processor, by piece */
    bool taken[2]; /* the processor was, in the middle of it */
} burden;

static void be_busy(void *self, int piece)
{
    burden *b = self;
    double wall = kmp_wall_now(), cpu = kmp_cpu_now();
    while (kmp_cpu_now() - cpu < b->s[piece])
        ;
    b->taken[piece] = b->taken[piece] || kmp_wall_now() - wall - b->s[piece] > 20e-6;
}

/* Whoever gets the short piece waits long for the other; nothing is late where no processor was taken away. */
static void unequal_pieces_stay_shared(void)
{
    int without_reason = 0;
    for (int k = 0; k < TEAMS; k++) {
        burden b = {{20e-6, 300e-6}, {false, false}};
        kmp_team *team = kmp_team_new(2);
        for (int call = 0; team && call < CALLS && !kmp_team_rests(team); call++)
            kmp_team_run(team, 2, be_busy, &b);
        without_reason += !team || (kmp_team_rests(team) && !b.taken[0] && !b.taken[1]);
        kmp_team_free(team);
    }
    CHECK(without_reason <= 1); /* it may be taken away between two looks at the clocks */
}

typedef struct sleeper {
    pthread_t requests;
    atomic_bool other_began;
} sleeper;

/* Another thread loses its processor; the one that asks waits until it has begun. */
static void lose_processor(void *self, int piece)
{
    sleeper *s = self;
    (void)piece;
    if (!pthread_equal(pthread_self(), s->requests)) {
        atomic_store(&s->other_began, true);
        (void)usleep(100000);
        return;
    }
    for (double from = kmp_wall_now(); !atomic_load(&s->other_began) && kmp_wall_now() - from < 10;)
        (void)sched_yield();
}

static void calls_that_come_late_are_followed_by_rest(void)
{
    kmp_team *team = kmp_team_new(2);
    sleeper s = {.requests = pthread_self()};
    CHECK(team != NULL && !kmp_team_rests(team));
    for (int rest = 16; team && rest <= 64; rest *= 2) {
        int alone = 0;
        long count[2] = {0};
        atomic_store(&s.other_began, false);
        kmp_team_run(team, 2, lose_processor, &s);
        for (; alone < 1000 && kmp_team_rests(team); alone++)
            kmp_team_run(team, 2, count_piece, count);
        CHECK(alone == rest && count[0] == rest && count[1] == rest);
    }
    kmp_team_free(team);
}

/* Time that others have used counts. */
static void time_of_all_is_known(void)
{
    kmp_team *team = kmp_team_new(2);
    burden b = {{0.02, 0.02}, {false, false}};
    double own = kmp_cpu_now(), others = kmp_team_cpu(team);
    kmp_team_run(team, 2, be_busy, &b);
    CHECK(kmp_cpu_now() - own + kmp_team_cpu(team) - others >= 0.04);
    CHECK(kmp_team_cpu(NULL) == 0);
    kmp_team_free(team);
}

/* -- parts ------------------------------------------------------------------------------------------- */

/* Instructions that read another part, and do not come after all. */
static int count_torn(const kmp_layout *l, int stage, int parts)
{
    const kmp_program *p = l->program;
    int torn = 0;
    for (int i = p->code[stage]; i < p->code[stage + 1]; i++)
        for (int k = 0; k < kmp_op_arity((kmp_op)p->instruction[i].op); k++) {
            int j = kmp_layout_instruction(l, kmp_instruction_operand(&p->instruction[i], k));
            if (j >= p->code[stage] && l->part[j] != 0 && l->part[j] != l->part[i])
                torn += l->part[i] != parts + 1;
        }
    return torn;
}

/* The number of parts of a stage; its share of instructions that are in none. */
static int parts_of(const kmp_program *p, int stage, kmp_team *team, double *outside)
{
    kmp_layout l = {0};
    kmp_frame frame = {0};
    int parts = -1, count = p->code[stage + 1] - p->code[stage], out = 0;
    if (kmp_layout_init(&l, &frame, p, kmp_code_is_straight, 0, NULL, kmp_team_threads(team))) {
        parts = kmp_frame_parts(&frame, stage);
        CHECK(count_torn(&l, stage, parts) == 0);
        for (int i = p->code[stage]; i < p->code[stage + 1]; i++)
            out += l.part[i] == 0 || l.part[i] == parts + 1;
    }
    *outside = (double)out / count;
    kmp_layout_free(&l);
    kmp_frame_free(&frame);
    return parts;
}

static void bogies_fall_apart(void)
{
    loaded s = load("tests/models/three_bogies.yaml");
    kmp_team *team = kmp_team_new(3);
    double outside;
    CHECK(kmp_motion_need(s.system) == KEMPE_OK);
    int parts = parts_of(s.system->motion, KMP_STAGE_BIAS, team, &outside);
    CHECK(parts >= 3);
    CHECK(outside < 0.06); /* on three threads it then takes 0.06 + 0.94/3 of the time: 2.7 times as fast */
    CHECK(parts_of(s.system->motion, KMP_STAGE_CLOSURE, team, &outside) == 0); /* too small */
    kmp_team_free(team);
    unload(&s);
}

/* Many more blocks, which are derivatives of others and read what those read. */
static void tangents_fall_apart(void)
{
    loaded s = load("tests/models/three_bogies.yaml");
    kmp_team *team = kmp_team_new(3);
    kmp_tangents tangents = {0};
    double outside;
    CHECK(kmp_tangents_init(&tangents, s.system, kmp_backend_find("tape"), 1u << KMP_VALUE_R) == KEMPE_OK);
    CHECK(parts_of(tangents.tangent.program, 1, team, &outside) == 3);
    CHECK(outside < 0.05);
    kmp_tangents_free(&tangents);
    kmp_team_free(team);
    unload(&s);
}

/* Blocks that a part solves, each once for a list of arguments. */
static int solvings_of(const kmp_program *p, const kmp_layout *l, int stage, int part)
{
    int count = 0;
    for (int i = p->code[stage]; i < p->code[stage + 1]; i++) {
        bool first = p->instruction[i].op == KMP_OP_IMPLICIT && l->part[i] == part;
        for (int j = p->code[stage]; first && j < i; j++)
            first = p->instruction[j].op != KMP_OP_IMPLICIT || p->instruction[j].a != p->instruction[i].a ||
                    p->instruction[j].b != p->instruction[i].b;
        count += first;
    }
    return count;
}

/* Parts are begun as they are numbered. */
static void largest_begin_first(void)
{
    loaded s = load("tests/models/three_bogies.yaml");
    CHECK(kmp_motion_need(s.system) == KEMPE_OK);
    const kmp_program *p = s.system->motion;
    kmp_team *team = kmp_team_new(4);
    kmp_layout l = {0};
    kmp_frame frame = {0};
    CHECK(kmp_layout_init(&l, &frame, p, kmp_code_is_straight, 0, NULL, kmp_team_threads(team)));
    int parts = kmp_frame_parts(&frame, KMP_STAGE_BIAS);
    CHECK(parts > 1);
    for (int k = 1; k < parts; k++)
        CHECK(solvings_of(p, &l, KMP_STAGE_BIAS, k) >= solvings_of(p, &l, KMP_STAGE_BIAS, k + 1));
    CHECK(solvings_of(p, &l, KMP_STAGE_BIAS, 1) > solvings_of(p, &l, KMP_STAGE_BIAS, parts));
    kmp_layout_free(&l);
    kmp_frame_free(&frame);
    kmp_team_free(team);
    unload(&s);
}

/* A state near the start, another one each time. */
static void move(const kempe_assembly *start, int n, int k, double *q, double *qd)
{
    for (int i = 0; i < n; i++) {
        q[i] = kempe_assembly_q(start)[i] + 1e-5 * sin(k + i);
        qd[i] = kempe_assembly_qd(start)[i] + 1e-3 * cos(2 * k + i);
    }
}

/* The equations at a state, one after another: n, n, m and 1 values. */
static void evaluate(kmp_evaluator *eval, const double *q, const double *qd, double *out)
{
    size_t n = (size_t)eval->n, m = (size_t)eval->m;
    kmp_eval_freeze(eval, 0, q, qd);
    kmp_eval_closure(eval, 0, q);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, qd);
    memcpy(out, eval->bias, n * sizeof *out);
    memcpy(out + n, eval->jdqd, m * sizeof *out);
    out[n + m] = kmp_eval_power(eval, 0, q, qd);
}

/* States with other bits, or with no numbers. */
static int count_other(const kempe_assembly *start, kmp_evaluator *one, kmp_evaluator *shared)
{
    double q[256], qd[256], a[512], b[512];
    int bad = 0, count = one->n + one->m + 1;
    for (int k = 0; k < 50; k++) {
        bool numbers = true;
        move(start, one->n, k, q, qd);
        evaluate(one, q, qd, a);
        evaluate(shared, q, qd, b);
        for (int i = 0; i < count; i++)
            numbers = numbers && isfinite(a[i]);
        bad += memcmp(a, b, (size_t)count * sizeof *a) != 0 || !numbers;
    }
    return bad;
}

static void bits_are_the_same(const char *file)
{
    loaded s = load(file);
    CHECK(kmp_motion_need(s.system) == KEMPE_OK);
    const kmp_program *programs[] = {s.system->motion, s.system->judge};
    kempe_assembly *start = NULL;
    CHECK(kempe_assembly_new(s.system, &start) == KEMPE_OK);
    kmp_evaluator *one = kmp_eval_new(s.system, "native");
    for (int threads = 2; threads <= 4; threads++) {
        kmp_team *team = kmp_team_new(threads);
        kmp_evaluator *shared = kmp_eval_new_for(s.system, "native", team, KMP_EVAL_STEPS);
        double outside;
        for (int k = 0; k < 2; k++)
            for (int stage = 1; stage < programs[k]->stages; stage++)
                CHECK(parts_of(programs[k], stage, team, &outside) >= 0);
        CHECK(parts_of(s.system->motion, KMP_STAGE_BIAS, team, &outside) > 1);
        CHECK(count_other(start, one, shared) == 0);
        kmp_eval_free(shared);
        kmp_team_free(team);
    }
    kmp_eval_free(one);
    kempe_assembly_free(start);
    unload(&s);
}

static void bogies_have_the_same_bits(void)
{
    bits_are_the_same("tests/models/three_bogies.yaml");
}

/* One tree: the wagon comes before its axles, and adds them up after. */
static void wagon_has_the_same_bits(void)
{
    bits_are_the_same("examples/curving/curving.yaml");
}

/* True if there is room for a layout in parts. */
static bool can_lay_out(const kmp_program *p, kmp_team *team)
{
    kmp_layout l = {0};
    kmp_frame frame = {0};
    bool done = kmp_layout_init(&l, &frame, p, kmp_code_is_straight, 0, NULL, kmp_team_threads(team));
    CHECK(!done || kmp_frame_parts(&frame, KMP_STAGE_BIAS) > 1);
    kmp_layout_free(&l);
    kmp_frame_free(&frame);
    return done;
}

/* Each allocation fails once, and none can be done without. */
static void memory_may_end(void)
{
    loaded s = load("examples/curving/curving.yaml");
    kmp_team *team = kmp_team_new(2);
    unsigned long before = kmp_memory_count(), count, failed = 0;
    CHECK(can_lay_out(s.system->motion, team));
    count = kmp_memory_count() - before;
    for (unsigned long n = 1; n <= count; n++) {
        kmp_memory_fail_at(n);
        failed += !can_lay_out(s.system->motion, team);
        kmp_memory_fail_at(0);
    }
    printf("  %lu allocations\n", count);
    CHECK(failed == count && count > 0);
    kmp_team_free(team);
    kmp_memory_fail_at(1);
    CHECK(kmp_team_new(2) == NULL);
    kmp_memory_fail_at(0);
    unload(&s);
}

/* -- runs -------------------------------------------------------------------------------------------- */

static kempe_trajectory *run(const loaded *s, const char *formulation, int threads)
{
    kempe_trajectory *t = NULL;
    kempe_run_options run = {0};
    run.formulation = formulation;
    run.integrator = independent_integrator(formulation);
    run.threads = threads;
    run.no_convergence_check = 1;
    CHECK(kempe_simulate(s->system, &run, &t) == KEMPE_OK);
    return t;
}

/* Right-hand side and Jacobian of the reduced formulation at the start, with a team of so many threads; NULL: no
 * memory. *pieces: of the Jacobian's columns. */
static double *linearise(const loaded *s, const kempe_assembly *start, int threads, int *size, int *pieces)
{
    kmp_run_spec spec = {
        .formulation = "reduced", .integrator = "radau5", .rtol = 1e-6, .t_end = 1, .threads = threads};
    kmp_runner *run = NULL;
    CHECK(kmp_run_resolve(s->system, &spec) == KEMPE_OK && kmp_runner_new(s->system, &spec, start, &run) == KEMPE_OK);
    const kmp_ode *ode = &run->formulation->ode;
    size_t n = (size_t)ode->n;
    double *out = KMP_NEW(double, n *(n + 1));
    CHECK(ode->rhs(ode->self, 0, run->formulation->y, out) == KMP_GO);
    CHECK(ode->jacobian(ode->self, 0, run->formulation->y, out + n) == KMP_GO);
    *size = ode->n;
    *pieces = ((kmp_reduced *)run->formulation)->tangents.pieces;
    kmp_runner_free(run);
    return out;
}

/* The reduced mass is computed beside C, and columns of the Jacobian by all threads. */
static void linear_algebra_has_the_same_bits(void)
{
    loaded s = load("examples/tram/tram.yaml");
    kempe_assembly *start = NULL;
    int size, pieces;
    CHECK(kempe_assembly_new(s.system, &start) == KEMPE_OK);
    double *one = linearise(&s, start, 1, &size, &pieces);
    CHECK(pieces == 1 && size > 2 * 48);
    for (int threads = 2; threads <= 4; threads++) {
        double *shared = linearise(&s, start, threads, &size, &pieces);
        CHECK(pieces > threads);
        CHECK(memcmp(one, shared, (size_t)size * (size_t)(size + 1) * sizeof *one) == 0);
        kmp_free(shared);
    }
    kmp_free(one);
    kempe_assembly_free(start);
    unload(&s);
}

static void runs_have_the_same_bits(void)
{
    loaded s = load("tests/models/three_bogies.yaml");
    const char *const formulations[] = {"reduced", "dae"};
    double cpu_s[2] = {0};
    for (int r = 0; r < 2; r++) {
        kempe_trajectory *one = run(&s, formulations[r], 1), *shared = run(&s, formulations[r], 3);
        int rows = kempe_trajectory_row_count(one);
        size_t bytes = (size_t)s.system->n * sizeof(double);
        CHECK(rows == 5 && kempe_trajectory_row_count(shared) == rows);
        CHECK(memcmp(kempe_trajectory_q(one, rows - 1), kempe_trajectory_q(shared, rows - 1), bytes) == 0);
        CHECK(memcmp(kempe_trajectory_qd(one, rows - 1), kempe_trajectory_qd(shared, rows - 1), bytes) == 0);
        CHECK(one->report.wall_s == 0 && shared->report.wall_s > 0);
        cpu_s[0] += one->report.cpu_s;
        cpu_s[1] += shared->report.cpu_s;
        kempe_trajectory_free(one);
        kempe_trajectory_free(shared);
    }
    CHECK(cpu_s[1] > 0.8 * cpu_s[0]); /* shared work is work */
    kempe_run_options many = {0};
    kempe_trajectory *none = NULL;
    many.threads = 65;
    CHECK(kempe_simulate(s.system, &many, &none) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(s.context), "65 threads: 1 to 64 are possible");
    unload(&s);
}

int main(void)
{
    TEST(each_piece_is_done_once);
    TEST(brought_pieces_are_done_once);
    TEST(threads_have_numbers_of_their_own);
    TEST(unequal_pieces_stay_shared);
    TEST(calls_that_come_late_are_followed_by_rest);
    TEST(time_of_all_is_known);
    TEST(bogies_fall_apart);
    TEST(tangents_fall_apart);
    TEST(largest_begin_first);
    TEST(bogies_have_the_same_bits);
    TEST(wagon_has_the_same_bits);
    TEST(memory_may_end);
    TEST(linear_algebra_has_the_same_bits);
    TEST(runs_have_the_same_bits);
    return check_report();
}
