/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: rail */
/* The nearest points of a wheel and its rail, zone by zone, against a scan so fine that it misses nothing: thousands of
 * places, those where the point jumps among them. */
#include "base/text.h"
#include "dynamics/system.h"
#include "loaded.h"
#include "model/data/wheels.h"
#include "random.h"
#include "symbolic/implicit.h"
#include "symbolic/interpreter.h"
#include "symbolic/solving.h"
#include <math.h>

static const char *const text =
    "kempe: 1\n"
    "profiles:\n"
    "  wheel: {csv: ../../examples/profiles/%s.csv, y: y, z: z}\n"
    "  head: {csv: ../../examples/profiles/uic60.csv, y: y, z: z}\n"
    "tracks: {line: {at: ground.O, rail: head, gauge: 1435 mm, inclination: 1/40}}\n"
    "ground: {points: {O: [0, 0, 0]}}\n"
    "bodies:\n"
    "  set:\n"
    "    joint: {name: S, motions: [T1, T2, T3, R3, R1, R2], at: ground}\n"
    "    mass: 1250\n"
    "    inertia: {xx: 700, yy: 100, zz: 700}\n"
    "    points: {L: [0, 0.75, 0]}\n"
    "wheels: {L: {on: line.left, at: set.L, profile: wheel, radius: 0.46, contact: rigid, creep: none}}\n";

enum { OUT, AXLE, ARGUMENTS = 4, POSES = 1000 };

/* Somewhere the merit of a block. */
static double merit_at(kmp_interpreter *it, double s)
{
    kmp_interpreter_set(it, KMP_IN_Q, &s);
    return *kmp_interpreter_run(it, 2);
}

/* The least merit on a grid, and on finer ones around its best. */
static double least_merit(kmp_interpreter *it, const kmp_program_block *b)
{
    const double step = 1e-4, margin = 3e-3;
    double least = INFINITY, at = 0;
    for (double s = b->candidate[0] - margin; s < b->candidate[b->candidates - 1] + margin; s += step)
        if (merit_at(it, s) < least) {
            least = merit_at(it, s);
            at = s;
        }
    for (double fine = step / 8; fine > 1e-9; fine /= 8) {
        double from = at - 8 * fine;
        for (int k = 0; k <= 16; k++)
            if (merit_at(it, from + k * fine) < least) {
                least = merit_at(it, from + k * fine);
                at = from + k * fine;
            }
    }
    return least;
}

/* Out of the track's middle by the wheelset's way, yaw and roll. */
static void pose(double *p)
{
    double way = between(-0.012, 0.012), yaw = between(-0.05, 0.05), roll = between(-0.02, 0.02);
    yaw *= pick(2) ? 1 : 0.02;
    roll *= pick(2) ? 1 : 0.02;
    p[OUT] = 0.75 * cos(yaw) * cos(roll) + way;
    p[AXLE] = -sin(yaw) * cos(roll);
    p[AXLE + 1] = cos(yaw) * cos(roll);
    p[AXLE + 2] = sin(roll);
}

/* The largest excess of the merit over its minimum, of all places; infinite if it is not a number. */
static double excess_of(const kmp_program_block *b)
{
    double excess = 0;
    kmp_solving *solving = kmp_solving_new(b, NULL);
    kmp_interpreter *it = kmp_interpreter_new(b->program);
    for (int k = 0; k < POSES; k++) {
        double *p = kmp_solving_arguments(solving);
        pose(p);
        kmp_interpreter_set(it, KMP_IN_PARAMETER, p);
        (void)kmp_interpreter_run(it, 0);
        double over = merit_at(it, kmp_solving_value(solving, 0)) - least_merit(it, b);
        excess = isfinite(over) ? fmax(excess, over) : INFINITY;
    }
    kmp_interpreter_free(it);
    kmp_solving_free(solving);
    return excess;
}

static void check_wheel(const char *profile, int expected)
{
    kmp_text all = {0};
    int zones = 0;
    kmp_text_printf(&all, text, profile);
    loaded l = load_text_as(all.s, KEMPE_ROOT "/tests/models/basin.yaml");
    for (int k = 0; l.system && k < l.system->motion->block_count; k++)
        if (l.system->motion->block[k].arguments == ARGUMENTS) {
            double excess = excess_of(&l.system->motion->block[k]);
            zones++;
            CHECK(excess < 1e-14);
            if (!(excess < 1e-14))
                printf("%s, zone %d: %g\n", profile, zones, excess);
        }
    CHECK(l.system && zones == kmp_model_wheel(l.model, 0)->zone_count && zones == expected);
    unload(&l);
    kmp_text_free(&all);
}

static void test_basins(void)
{
    random_seed(5);
    check_wheel("s1002", 4);
    check_wheel("cone20", 2);
}

int main(void)
{
    TEST(test_basins);
    return check_report();
}
