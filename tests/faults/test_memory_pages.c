/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow once 7 */
/* wings: road */
/* Every allocation fails once (test_memory.c), of the page of a run with contacts, gears, ropes, a cam and a tyre. */
#include "exhaust.h"

static const char *const text =
    "kempe: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "ground: {points: {O: [0, 0, 0], A: [1, 0, 0], B: [1.5, 0, 0], T: [3, 0, 0]}}\n"
    "outlines:\n"
    "  lobe: {circle: 50 mm, at: [10 mm, 0]}\n"
    "  disc: {law: [{to: 90 deg, rise: 10 mm, by: cycloidal}, {to: 180 deg}, {to: 270 deg, rise: -10 mm, by: harmonic},"
    " {to: 360 deg}], base: 32 mm, follower: {roller: 8 mm}}\n"
    "  star: {closed: yes, copies: 4, path: [[80 mm, 0], [60 mm, 60 mm]]}\n"
    "roads: {street: {at: ground.T, normal: y, along: x, height: \"10 mm*sin(x/(1 m))\"}}\n"
    "tyres: {tyre: {on: street, at: wheel.C, model: brush, radius: 0.3, vertical_stiffness: 2e5, tread_stiffness: 12e6,"
    " half_length: 60 mm, friction: 0.9}}\n"
    "bodies:\n"
    "  pinion: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.01}, points: {C: [0, 0, 0]}}\n"
    "  gear: {joint: {revolute: z, at: ground.A}, mass: 1, inertia: {zz: 0.01}, points: {C: [0, 0, 0]}}\n"
    "  rod: {joint: {name: lift, prismatic: y, at: ground.O}, mass: 1, points: {P: [0, 0, 0]}}\n"
    "  ball: {joint: {motions: [T1, T2, R3], coordinates: [x, y, a], at: ground.B}, mass: 1, inertia: {zz: 1e-3},"
    " points: {C: [0, 0, 0]}}\n"
    "  wheel: {joint: {motions: [T1, T2, R3], coordinates: [u, v, w], at: ground.T}, mass: 9, inertia: {zz: 1},"
    " points: {C: {at: [0, 0, 0], axes: {x: [1, 0, 0], y: [0, 0, 1]}}}}\n"
    "gears: {mesh: {between: [pinion, gear], teeth: [20, 40]}}\n"
    "ropes: {belt: {around: [{round: pinion.C, radius: 50 mm, turn: left, grip: yes},"
    " {round: gear.C, radius: 100 mm, turn: left, grip: yes}], axial_stiffness: 60 kN, preload: 300 N}}\n"
    "contacts: {star: {cylinder: ball.C, radius: 10 mm, on: {outline: star, at: ground.B}, restitution: 0, friction: "
    "0.2}}\n"
    "loops: {cam: {follower: rod.P, roller: 8 mm, on: {outline: disc, at: pinion.C}}}\n"
    "start: {q: {lift: 40 mm, y: 0.1, v: 0.29}, qd: {pinion: 5}}\n"
    "run: {t_end: 0.002}\n";

static kempe_status write_page(scene *s)
{
    return kempe_trajectory_write_report(s->trajectory, s->csv);
}

static void every_allocation_fails(void)
{
    scene s = {.context = kempe_context_new(), .csv = "/tmp/kempe_memory_page_XXXXXX"};
    const int file = mkstemp(s.csv);
    CHECK(file >= 0 && close(file) == 0);
    CHECK(kempe_model_read_text(s.context, text, "pages", &s.model) == KEMPE_OK);
    if (s.model)
        CHECK(kempe_system_new(s.model, &s.system) == KEMPE_OK);
    if (s.system)
        CHECK(kempe_simulate(s.system, NULL, &s.trajectory) == KEMPE_OK);
    if (s.trajectory)
        exhaust(&s, "page", write_page, 97);
    else
        printf("%s\n", kempe_context_message(s.context));
    (void)remove(s.csv);
    kempe_trajectory_free(s.trajectory);
    kempe_system_free(s.system);
    kempe_model_free(s.model);
    kempe_context_free(s.context);
}

int main(void)
{
    TEST(every_allocation_fails);
    return check_report();
}
