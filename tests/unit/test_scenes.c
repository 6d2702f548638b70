/* SPDX-License-Identifier: BSD-3-Clause */
/* Only what the scene needs: operation counts of the examples, planar mechanisms without any spatial work, programs
 * without what was not asked for. */
#include "constraints/evaluation/evaluator.h"
#include "derived.h"
#include "dynamics/equations.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/kempe.h>
#include <stdbool.h>

enum { MOTION = KMP_SET_MASS | KMP_SET_BIAS | KMP_SET_CLOSURE | KMP_SET_JDQD };

static kmp_counts motion_counts(const loaded *l)
{
    return kmp_program_count(l->system->motion, KMP_STAGE_CLOSURE, KMP_STAGE_BIAS);
}

/* -- the examples ------------------------------------------------------------------------------------------ */

/* Two angles are never equal: sine and cosine once an absolute angle. */
static void test_andrews(void)
{
    loaded l = load("examples/andrews/andrews.yaml");
    kmp_counts c = motion_counts(&l);
    printf("  andrews: %ld + %ld * %ld / %ld trig %ld other\n", c.add, c.mul, c.div, c.trig, c.other);
    CHECK(c.paper + c.other <= 170);
    CHECK(c.trig == 14);
    CHECK(kempe_system_row_count(l.system) == 6 && l.system->n == 7);
    CHECK(!l.system->rheonomic && !l.system->dissipative);
    unload(&l);
}

static void test_planar_examples(void)
{
    loaded bar = load("examples/four_bar/four_bar.yaml"), slider = load("examples/slider_crank/slider_crank.yaml");
    kmp_counts b = motion_counts(&bar), s = motion_counts(&slider);
    printf("  four-bar: %ld + %ld * %ld / %ld trig; slider-crank: %ld + %ld * %ld / %ld trig\n", b.add, b.mul, b.div,
           b.trig, s.add, s.mul, s.div, s.trig);
    CHECK(b.trig == 6 && s.trig == 4);
    CHECK(b.paper <= 90 && s.paper <= 60);
    CHECK(kempe_system_row_count(bar.system) == 2 && kempe_system_row_count(slider.system) == 2);
    unload(&bar);
    unload(&slider);
}

/* -- planar is planar, whatever the bodies are --------------------------------------------------------------- */

static const char planar_form[] = "kempe: 1\ngravity: [0.4, -9.81, 0]\n"
                                  "ground: {points: {O: [0, 0, 0], D: [0.9, 0, 0], S: [0.4, 1, 0]}}\n"
                                  "bodies:\n"
                                  "  crank: {joint: {revolute: z, at: ground.O}, mass: 1, com: [0.15, 0.02, %s],\n"
                                  "    inertia: {zz: 0.03%s}, points: {B: [0.3, 0, 0]}}\n"
                                  "  coupler: {joint: {revolute: -z, at: crank.B}, mass: 2, com: [0.4, 0.1, %s],\n"
                                  "    inertia: {zz: 0.1%s}, points: {C: [0.8, 0, 0]}}\n"
                                  "  rocker: {joint: {motions: [T1, R3], at: ground.D}, mass: 3, com: [0.3, 0.2, %s],\n"
                                  "    inertia: {zz: 0.2%s}, points: {C: [0.7, 0, 0]}}\n"
                                  "loops: {C: {ball: [coupler.C, rocker.C]}}\n"
                                  "forces: {s: {spring: [coupler.C, ground.S], stiffness: 10, damping: 1}}\n";

static loaded planar(const char *com_z, const char *inertia)
{
    char text[2048];
    (void)snprintf(text, sizeof text, planar_form, com_z, inertia, com_z, inertia, com_z, inertia);
    return load_text(text);
}

static bool same_counts(kmp_counts a, kmp_counts b)
{
    return a.add == b.add && a.mul == b.mul && a.div == b.div && a.trig == b.trig && a.other == b.other;
}

/* All outputs of the motion program at one state, as text of every digit. */
static void motion_values(const loaded *l, char *text, size_t size)
{
    state s;
    kmp_evaluator *eval = kmp_eval_new(l->system, "tape");
    const kmp_program *p = l->system->motion;
    size_t at = 0;
    random_seed(5);
    s = random_state_vectors();
    kmp_eval_closure(eval, 0, s.q);
    kmp_eval_mass(eval);
    kmp_eval_bias(eval, s.qd);
    for (int stage = KMP_STAGE_CLOSURE; stage <= KMP_STAGE_BIAS; stage++) {
        const double *out = kmp_machine_run(eval->motion, stage);
        for (int k = 0; k < p->outputs[stage + 1] - p->outputs[stage]; k++)
            at += (size_t)snprintf(text + at, size - at, "%a\n", out[k]);
    }
    kmp_eval_free(eval);
}

static void test_planar_bodies(void)
{
    static const char *const com[] = {"0.3", "0", "-2"};
    static const char *const inertia[] = {", xx: 0.15, yy: 0.16", ", xx: 0.15, yy: 0.16, xy: 0.01",
                                          ", xx: 0.15, yy: 0.16, xz: 0.01, yz: -0.02"};
    static char flat_values[4096], values[4096];
    loaded flat = planar("0", "");
    motion_values(&flat, flat_values, sizeof flat_values);
    for (int k = 0; k < 3; k++) {
        loaded l = planar(com[k], inertia[k]);
        motion_values(&l, values, sizeof values);
        CHECK(same_counts(motion_counts(&flat), motion_counts(&l)));
        CHECK_TEXT(values, flat_values);
        CHECK(flat.system->m == 2 && l.system->m == 2);
        unload(&l);
    }
    unload(&flat);
}

/* One mechanism in the plane of x and z, and in that of y and z: the same work. */
static void test_planes(void)
{
    static const char form[] = "kempe: 1\ngravity: %s\nground: {points: {D: %s}}\nbodies:\n"
                               "  a: {joint: {revolute: %s, at: ground}, mass: 1, com: %s, points: {B: %s}}\n"
                               "  b: {joint: {revolute: %s, at: a.B}, mass: 1, com: %s, points: {C: %s}}\n"
                               "  c: {joint: {revolute: %s, at: ground.D}, mass: 1, com: %s, points: {C: %s}}\n"
                               "loops: {C: {ball: [b.C, c.C]}}\n";
    static const char *const axis[] = {"z", "x", "y"};
    static const char *const long_x[] = {"[3, 1, 0]", "[0, 3, 1]", "[1, 0, 3]"};
    static const char *const short_x[] = {"[1, 2, 0]", "[0, 1, 2]", "[2, 0, 1]"};
    static char first[4096], values[4096];
    kmp_counts counts = {0};
    for (int k = 0; k < 3; k++) {
        char text[1024];
        const char *l = long_x[k], *s = short_x[k], *a = axis[k];
        (void)snprintf(text, sizeof text, form, l, l, a, s, l, a, s, s, a, l, l);
        loaded turned = load_text(text);
        motion_values(&turned, k ? values : first, sizeof values);
        if (k == 0)
            counts = motion_counts(&turned);
        CHECK(same_counts(motion_counts(&turned), counts));
        CHECK(turned.system->m == 2);
        unload(&turned);
    }
}

/* -- only what was asked for --------------------------------------------------------------------------------- */

static long operations(const kempe_model *model, unsigned sets, kmp_scheme scheme)
{
    derived d;
    CHECK(derived_init(&d, model, sets, scheme, false));
    long count = kmp_program_count(d.program, 0, 1).robotran;
    derived_free(&d);
    return count;
}

static void test_sets(void)
{
    loaded l = load("examples/andrews/andrews.yaml");
    long closure = operations(l.model, KMP_SET_CLOSURE, KMP_SCHEME_COMPOSITE);
    long mass = operations(l.model, KMP_SET_MASS, KMP_SCHEME_COMPOSITE);
    long ner = operations(l.model, KMP_SET_MASS, KMP_SCHEME_NER);
    long motion = operations(l.model, MOTION, KMP_SCHEME_COMPOSITE);
    long all = operations(l.model, 255, KMP_SCHEME_COMPOSITE);
    printf("  andrews: h, J %ld; M %ld (columns: %ld); motion %ld; all %ld\n", closure, mass, ner, motion, all);
    CHECK(0 < closure && closure < motion && 0 < mass && mass < motion && motion < all);
    CHECK(mass <= ner && motion < closure + mass + operations(l.model, KMP_SET_BIAS | KMP_SET_JDQD, 0));
    CHECK(operations(l.model, 0, KMP_SCHEME_COMPOSITE) == 0);
    unload(&l);
}

static int stage_length(const kmp_program *p, int stage)
{
    return p->code[stage + 1] - p->code[stage];
}

static void test_judge(void)
{
    loaded l = load_text("kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
                         "  a: {joint: {revolute: z, at: ground}, mass: 1, com: [1, 0, 0], points: {P: [1, 0, 0]}}\n");
    const kmp_program *judge = l.system->judge;
    CHECK(stage_length(judge, KMP_STAGE_POTENTIAL) > 0 && stage_length(judge, KMP_STAGE_POWER) == 0);
    CHECK(stage_length(judge, KMP_STAGE_REACTION) == 0 && stage_length(judge, KMP_STAGE_POSITION) == 0);
    CHECK(stage_length(l.system->motion, KMP_STAGE_CLOSURE) == 0 &&
          stage_length(l.system->motion, KMP_STAGE_MASS) == 0);
    CHECK(stage_length(l.system->motion, KMP_STAGE_PARAMETERS) == 0);
    CHECK(stage_length(l.system->motion, KMP_STAGE_BIAS) == 2); /* cos, times m g l */
    unload(&l);
    l = load("examples/andrews/andrews.yaml"); /* the force of a ball is its multipliers */
    CHECK(stage_length(l.system->judge, KMP_STAGE_REACTION) == 0);
    CHECK(stage_length(l.system->judge, KMP_STAGE_POWER) == 0);
    unload(&l);
}

int main(void)
{
    TEST(test_andrews);
    TEST(test_planar_examples);
    TEST(test_planar_bodies);
    TEST(test_planes);
    TEST(test_sets);
    TEST(test_judge);
    return check_report();
}
