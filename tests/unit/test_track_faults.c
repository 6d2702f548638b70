/* SPDX-License-Identifier: BSD-3-Clause */
/* wheels: rail */
/* A wheelset runs with 40 m/s over a fault of a few millimetres, which is short compared with its steps: it does not
 * pass unseen, but unloads the wheels at its beginning. */
#include "loaded.h"
#include <math.h>
#include <string.h>

static const char wheelset[] =
    "kempe: 1\n"
    "gravity: [0, 0, -9.81]\n"
    "parameters: {V: 40 m/s, r: 0.46, w: 5 mm}\n"
    "profiles:\n"
    "  tread: {csv: examples/profiles/s1002.csv, y: y, z: z}\n"
    "  head: {csv: examples/profiles/uic60.csv, y: y, z: z}\n"
    "tables:\n"
    "  dip: {x: [-10, 0, 20 - w, 20 - w/2, 20, 20 + w/2, 20 + w, 40, 100], y: [0, 0, 0, -4 um, -10 um, -4 um, 0, 0, "
    "0],\n"
    "        method: monotone}\n"
    "tracks: {line: {at: ground.O, rail: head, gauge: 1435 mm, inclination: 1/40, irregularities: {level: dip}}}\n"
    "ground: {points: {O: [0, 0, 0]}}\n"
    "bodies:\n"
    "  hanger: {joint: {motions: [T1, T2, T3, R3, R1], coordinates: [x, y, z, yaw, roll], at: ground}}\n"
    "  wheelset:\n"
    "    joint: {name: spin, revolute: y, at: hanger}\n"
    "    mass: 1500\n"
    "    inertia: {xx: 800, yy: 120, zz: 800}\n"
    "    points: {L: [0, 0.75, 0], R: [0, -0.75, 0]}\n"
    "  box: {joint: {name: bz, prismatic: z, at: hanger}, mass: 5000}\n"
    "forces: {susp: {joint: bz, spring: {stiffness: 1e6, damping: 1e4}}}\n"
    "wheels:\n"
    "  L: {on: line.left, at: wheelset.L, profile: tread, radius: r, contact: rigid, creep: polach}\n"
    "  R: {on: line.right, at: wheelset.R, profile: tread, radius: r, contact: rigid, creep: polach}\n"
    "start: {q: {z: r, bz: -0.04905}, hold: [y, yaw], qd: {x: V, spin: V/r}}\n"
    "run: {t_end: 0.7, outputs: [q, qd]}\n";

static void short_faults_are_found(void)
{
    static const char *const widths[] = {"50 mm", "5 mm", "1 mm"};
    for (int k = 0; k < 3; k++) {
        const kempe_setting set = {"w", widths[k]};
        const kempe_run_options options = {.no_convergence_check = 1};
        loaded l = {.context = kempe_context_new()};
        kempe_trajectory *run = NULL;
        CHECK(kempe_model_read_text_set(l.context, wheelset, KEMPE_ROOT "/model.yaml", &set, 1, &l.model) == KEMPE_OK);
        l = load_finish(l);
        CHECK(l.system && kempe_simulate(l.system, &options, &run) == KEMPE_STOPPED);
        const int last = run ? kempe_trajectory_row_count(run) - 1 : -1;
        CHECK(last > 0 && fabs(kempe_trajectory_time(run, last) - 0.4998) < 1e-3);
        kempe_trajectory_free(run);
        unload(&l);
    }
}

int main(void)
{
    TEST(short_faults_are_found);
    return check_report();
}
