/* SPDX-License-Identifier: BSD-3-Clause */
/* Flexible bodies in their mean axes: frequencies of free beams, shapes without momentum, the motion of the same body
 * in three frames, conserved momentum, joints that are refused. */
#include "loaded.h"
#include "model/data/flexible.h"
#include "model/data/model.h"
#include "run_ends.h"
#include "studies/assembly/flexible_check.h"
#include "testing.h"
#include <kempe/table.h>
#include <math.h>
#include <stdio.h>

static void frequencies_of_a_free_beam(void)
{
    static const double root[3] = {22.3732854, 61.6728229, 120.9033916};
    loaded l = load_text("kempe: 1\nbodies:\n  rod:\n    joint: {free: x, at: ground}\n    flexible:\n"
                         "      beam: {length: 2, rhoA: 3, EIz: 5000, rhoI: 1e-7}\n      shapes: {y: 12}\n"
                         "      frame: mean\n      stiffening: none\n");
    kmp_flexible_spectrum s;
    CHECK(l.model && kmp_flexible_spectrum_find(l.model->flexibles, &s));
    for (int k = 0; k < 3 && l.model; k++) {
        CHECK_NEAR(s.fixed[k] / (root[k] / 4 * sqrt(5000 / 3.0)), 1, k < 2 ? 1e-7 : 1e-6);
        CHECK_NEAR(s.free[k] / s.fixed[k], 1, 1e-9);
    }
    CHECK(l.model && kmp_flexible_rigid_part(l.model->flexibles) < 1e-14);
    unload(&l);
    l = load_text("kempe: 1\nbodies:\n  rod:\n    joint: {free: x, at: ground}\n    flexible:\n"
                  "      beam: {length: 2, rhoA: 3, EIz: 5000, rhoI: 1e-3}\n      shapes: {y: 2}\n      rotary: yes\n");
    /* The effective mass of the first mode of a clamped beam is 0.613 of the beam, the square of 0.783. */
    CHECK(l.model && kmp_flexible_rigid_part(l.model->flexibles) > 0.78);
    unload(&l);
}

/* Also with shear, rotary inertia, a taper; zeros are exact where numbers do not follow parameters. */
static void shapes_have_no_momentum(void)
{
    static const char *const beams[] = {
        "section: {rectangle: [80 mm, 50 mm]}}\n      rotary: yes\n      shear: yes\n",
        "section: {rectangle: [80 mm, 50 mm]}, taper: {rectangle: [30 mm, 40 mm]}}\n      raw: yes\n",
        "section: {tube: [b, b/2]}, taper: {tube: [b/2, b/4]}}\n"};
    for (int i = 0; i < 3; i++) {
        char text[1024];
        (void)snprintf(
            text, sizeof text,
            "kempe: 1\nparameters: {b: 60 mm}\nbodies:\n  rod:\n    joint: {free: x, at: ground}\n    flexible:\n"
            "      frame: mean\n      shapes: {y: 3, z: 2, torsion: 2, axial: 2}\n"
            "      beam: {length: 1, young: 70 GPa, poisson: 0.3, density: 2700, %s",
            beams[i]);
        loaded l = load_text(text);
        const kmp_flexible *f = l.model ? l.model->flexibles : NULL;
        for (int k = 0; f && k < f->count; k++)
            for (int a = 0; a < 3; a++) {
                const kmp_number *z = f->by_place + (ptrdiff_t)9 * k;
                const double p = f->field[3 * k + a].value;
                const double spin = z[3 * ((a + 2) % 3) + (a + 1) % 3].value - z[3 * ((a + 1) % 3) + (a + 2) % 3].value;
                CHECK(fabs(p) <= (i < 2 ? 0 : 1e-14) && fabs(spin) <= (i < 2 ? 0 : 1e-14));
            }
        unload(&l);
    }
}

#define FLOATING                                                                                                       \
    "kempe: 1\ngravity: [0, 0, %g]\nbodies:\n  rod:\n    joint: {free: x, at: ground}\n    flexible:\n"                \
    "      beam: {length: 2, young: 70 GPa, poisson: 0.3, density: 2700, section: {rectangle: [30 mm, 20 mm]}%s}\n"    \
    "      shapes: {y: 4, z: 4, torsion: 2}\n      frame: %s\n      stiffening: full\n"                                \
    "    points: {root: {station: 0}, tip: {station: 2}, mid: {station: 1}}\n%s"                                       \
    "start: {qd: {rod.6: 1, rod.5: 0.3}}\n"

static void take(const char *text, const char *outputs, int count, double first[], double last[])
{
    loaded l = load_text(text);
    const kempe_run_options run = {
        .t_end = 0.2, .output_step = 0.2, .rtol = 1e-9, .integrator = "radau", .no_convergence_check = 1};
    run_ends(&l, &run, KEMPE_OK, outputs, count, first, last);
    unload(&l);
}

/* A tapered beam that turns, falls and is pushed at its end; deflections of 1e-3 m. */
static void three_frames_move_alike(void)
{
    static const char *const frames[] = {"mean", "clamped", "chord"};
    double place[3][9], first[9];
    for (int i = 0; i < 3; i++) {
        char text[1024];
        (void)snprintf(text, sizeof text, FLOATING, -9.81, ", taper: {rectangle: [15 mm, 20 mm]}", frames[i],
                       "forces: {f: {at: rod.tip, force: [0, '3*sin(30*t)', '5*sin(20*t)']}}\n");
        take(text, "position(rod.tip),position(rod.root),position(rod.mid)", 9, first, place[i]);
        for (int k = 0; k < 9; k++)
            CHECK_NEAR(place[i][k], place[0][k], 2e-8);
    }
}

static void momentum_is_conserved(void)
{
    char text[1024];
    double first[9], last[9];
    (void)snprintf(text, sizeof text, FLOATING, 0.0, "", "mean", "");
    take(text, "momentum,angular_momentum,energy", 9, first, last);
    for (int k = 0; k < 6; k++)
        CHECK_NEAR(last[k], first[k], 1e-8);
    CHECK_NEAR(last[8], first[8], 1e-8);
    CHECK(fabs(first[5]) > 1 && fabs(last[7]) < 1e-2 * last[6]);
}

/* A free section has no loads. */
static void ends_are_free(void)
{
    char text[1024];
    double first[12], last[12];
    (void)snprintf(text, sizeof text, FLOATING, -9.81, "", "mean",
                   "forces: {f: {at: rod.tip, force: [0, '3*sin(30*t)', 0]}}\n");
    take(text, "section(rod.root),section(rod.tip)", 12, first, last);
    for (int k = 0; k < 6; k++)
        CHECK_NEAR(last[k], 0, 1e-10);
    CHECK_NEAR(hypot(last[6], last[7]), fabs(3 * sin(6)), 1e-3);
}

int main(void)
{
    TEST(frequencies_of_a_free_beam);
    TEST(shapes_have_no_momentum);
    TEST(three_frames_move_alike);
    TEST(momentum_is_conserved);
    TEST(ends_are_free);
    return check_report();
}
