/* SPDX-License-Identifier: BSD-3-Clause */
/* A team does every piece once and is done when it says so; equations in parts have the bits of those in one. */
#include "backend/code.h"
#include "backend/parts.h"
#include "base/memory.h"
#include "constraints/plant.h"
#include "loaded.h"
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

/* How many parts a stage has; its share of instructions that are in none. */
static int parts_of(const kmp_program *p, int stage, kmp_team *team, double *outside)
{
    kmp_layout l = {0};
    kmp_frame frame = {0};
    int parts = -1, count = p->code[stage + 1] - p->code[stage], out = 0;
    if (kmp_layout_init(&l, &frame, p, kmp_code_is_straight, 0, NULL, team)) {
        parts = frame.parting[stage].parts;
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
    CHECK(parts_of(s.system->motion, KMP_STAGE_BIAS, team, &outside) == 3);
    CHECK(outside < 0.05); /* on three threads it then takes 0.05 + 0.95/3 of the time: 2.7 times as fast */
    CHECK(parts_of(s.system->motion, KMP_STAGE_CLOSURE, team, &outside) == 0); /* too small */
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
static void evaluate(kmp_plant *plant, const double *q, const double *qd, double *out)
{
    size_t n = (size_t)plant->n, m = (size_t)plant->m;
    kmp_plant_freeze(plant, 0, q, qd);
    kmp_plant_closure(plant, 0, q);
    kmp_plant_mass(plant);
    kmp_plant_bias(plant, qd);
    memcpy(out, plant->bias, n * sizeof *out);
    memcpy(out + n, plant->jdqd, m * sizeof *out);
    out[n + m] = kmp_plant_power(plant, 0, q, qd);
}

/* States with other bits, or with no numbers. */
static int count_other(const kempe_assembly *start, kmp_plant *one, kmp_plant *shared)
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
    const kmp_program *programs[] = {s.system->motion, s.system->judge};
    kempe_assembly *start = NULL;
    CHECK(kempe_assemble(s.system, &start) == KEMPE_OK);
    kmp_plant *one = kmp_plant_new(s.system, "native");
    for (int threads = 2; threads <= 4; threads++) {
        kmp_team *team = kmp_team_new(threads);
        kmp_plant *shared = kmp_plant_new_shared(s.system, "native", team);
        double outside;
        for (int k = 0; k < 2; k++)
            for (int stage = 1; stage < programs[k]->stages; stage++)
                CHECK(parts_of(programs[k], stage, team, &outside) >= 0);
        CHECK(parts_of(s.system->motion, KMP_STAGE_BIAS, team, &outside) > 1);
        CHECK(count_other(start, one, shared) == 0);
        kmp_plant_free(shared);
        kmp_team_free(team);
    }
    kmp_plant_free(one);
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

/* Whether there is room for a layout in parts. */
static bool can_lay_out(const kmp_program *p, kmp_team *team)
{
    kmp_layout l = {0};
    kmp_frame frame = {0};
    bool done = kmp_layout_init(&l, &frame, p, kmp_code_is_straight, 0, NULL, team);
    CHECK(!done || frame.parting[KMP_STAGE_BIAS].parts > 1);
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

static kempe_trajectory *run(const loaded *s, const char *road, int threads)
{
    kempe_trajectory *t = NULL;
    kempe_run run = kempe_run_default();
    run.road = road;
    run.threads = threads;
    run.once = 1;
    CHECK(kempe_simulate(s->system, &run, &t) == KEMPE_OK);
    return t;
}

static void runs_have_the_same_bits(void)
{
    loaded s = load("tests/models/three_bogies.yaml");
    const char *const roads[] = {"reduced", "dae"};
    for (int r = 0; r < 2; r++) {
        kempe_trajectory *one = run(&s, roads[r], 1), *shared = run(&s, roads[r], 3);
        int rows = kempe_trajectory_row_count(one);
        size_t bytes = (size_t)s.system->n * sizeof(double);
        CHECK(rows == 5 && kempe_trajectory_row_count(shared) == rows);
        CHECK(memcmp(kempe_trajectory_q(one, rows - 1), kempe_trajectory_q(shared, rows - 1), bytes) == 0);
        CHECK(memcmp(kempe_trajectory_qd(one, rows - 1), kempe_trajectory_qd(shared, rows - 1), bytes) == 0);
        kempe_trajectory_free(one);
        kempe_trajectory_free(shared);
    }
    kempe_run many = kempe_run_default();
    kempe_trajectory *none = NULL;
    many.threads = 65;
    CHECK(kempe_simulate(s.system, &many, &none) == KEMPE_E_ARGUMENT);
    CHECK_TEXT(kempe_context_message(s.context), "65 threads: 1 to 64 are possible");
    unload(&s);
}

int main(void)
{
    TEST(each_piece_is_done_once);
    TEST(bogies_fall_apart);
    TEST(bogies_have_the_same_bits);
    TEST(wagon_has_the_same_bits);
    TEST(memory_may_end);
    TEST(runs_have_the_same_bits);
    return check_report();
}
