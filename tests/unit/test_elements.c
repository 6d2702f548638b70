/* SPDX-License-Identifier: BSD-3-Clause */
/* The library of machine elements: each in a small machine, by closed forms and by digits of references. */
#include "ways.h"
#include <kempe/table.h>
#include <math.h>

#define TURNS(name, inertia)           "  " name ": {joint: {revolute: z, at: ground}, mass: 1, inertia: {zz: " inertia "}}\n"
#define SLIDES(name, mass)             "  " name ": {joint: {prismatic: x, at: ground}, mass: " mass ", points: {Q: [0, 0, 0]}}\n"
#define INCLUDE(element, prefix, rest) "include: [{file: kempe:" element ".yaml, prefix: " prefix ", " rest "}]\n"

typedef struct machine {
    const char *text; /* without `kempe: 1` */
    double t_end;
    const char *output;
    double wanted, tolerance; /* at the end */
} machine;

static const char clutch[] =
    "inputs: {press: {t: [0, 0.1, 1], value: [0, 408.163265306122, 408.163265306122], "
    "method: linear, unit: N}}\n" INCLUDE(
        "plate_clutch", "c_", "ports: {A: a, B: b, press: press}, set: {mu_static: 0.375}") "bodies:\n" TURNS("a",
                                                                                                              "0.1")
        TURNS("b", "0.3") "forces: {motor: {joint: a, torque: 5}, load: {joint: b, torque: -3}}\n"
                          "start: {qd: {a: 100}}\n";

static const char gas[] =
    INCLUDE("gas_spring", "g_",
            "ports: {P: ground.P, Q: a.Q}") "ground: {points: {P: [0, 0, "
                                            "0]}}\nbodies:\n" SLIDES(
                                                "a", "1") "drives: {hold: {joint: a, displacement: 0.35}}\n";

static const char air[] = "gravity: [-9.81, 0, 0]\n" INCLUDE(
    "air_spring", "s_",
    "ports: {P: ground.P, Q: a.Q}, set: {height: 0.5 m}") "ground: {points: {P: [-0.5, 0, "
                                                          "0]}}\nbodies:\n" SLIDES("a", "\"6e5*0.02/9.81\"") "start:"
                                                                                                             " {q: "
                                                                                                             "{a: "
                                                                                                             "-0.03}"
                                                                                                             "}\n";

static const char cylinder[] =
    INCLUDE("blocked_cylinder", "c_", "ports: {J: a}") "bodies:\n" SLIDES("a", "200") "start: {qd: {a: 0.9}}\n";

static const char damper[] =
    INCLUDE("torsional_damper", "d_", "ports: {hub: hub}, set: {damping: 8.70388279778489}") "bodies:\n" TURNS(
        "hub", "0.5") "forces: {shaft: {joint: hub, spring: {stiffness: 5000}}, m: {joint: hub, torque: "
                      "\"sin(95.3462589245592*t)\"}}\n"
                      "sensors: {amplitude: \"5000*sqrt(q(hub)^2 + (qd(hub)/95.3462589245592)^2)\"}\n";

#define BAND(torque)                                                                                                   \
    "inputs: {pull: {default: 10 N, unit: N}}\n" INCLUDE(                                                              \
        "band_brake", "b_",                                                                                            \
        "ports: {J: a, pull: pull}, set: {mu: 0.2, wrap: 180 deg, "                                                    \
        "radius: 100 mm}") "bodies:\n" TURNS("a", "0.1") "forces: {m: "                                                \
                                                         "{joint: a, "                                                 \
                                                         "torque: " torque "}}\n"

#define FREEWHEEL(on_a, on_b)                                                                                          \
    INCLUDE("freewheel", "f_", "ports: {A: a, B: b}, set: {drag: 0.25}")                                               \
    "bodies:\n" TURNS("a", "0.1") TURNS("b", "0.3") "forces: {m: {joint: a, torque: " on_a                             \
                                                    "}, l: {joint: b, torque: " on_b "}}\n"

#define DRUM(leading, rate)                                                                                            \
    "inputs: {press: {default: 100 N, unit: N}}\n" INCLUDE("drum_brake", "d_",                                         \
                                                           "ports: {J: a, press: press}, set: {" leading               \
                                                           "}") "bodies:\n" TURNS("a", "0.1") "start: {qd: {a: " rate  \
                                                                                              "}}\n"

#define DIFFERENTIAL(locking)                                                                                          \
    INCLUDE("differential", "d_", "ports: {cage: c, left: l, right: r}, set: {locking: " locking "}")                  \
    "bodies:\n" TURNS("c", "0.05") TURNS("l", "0.3") TURNS("r", "0.5") "forces: {m: {joint: c, torque: 40}, b: "       \
                                                                       "{joint: l, torque: -10}}\n"

#define COUPLING(play)                                                                                                 \
    INCLUDE("flexible_coupling", "c_", "ports: {A: a, B: b}, set: {damping: 0, play: " play "}")                       \
    "bodies:\n" TURNS("a", "0.1") TURNS("b", "0.3") "start: {qd: {a: 1}}\nsensors: {angle: q(a) - q(b)}\n"

#define CHAIN(start)                                                                                                   \
    INCLUDE("chain_drive", "c_", "ports: {A: a, B: b}")                                                                \
    "bodies:\n" TURNS("a", "0.1") TURNS("b", "0.3") "forces: {m: {joint: a, torque: 1}}\nstart: {qd: {" start "}}\n"

#define WINCH(press, mu)                                                                                               \
    "gravity: [0, 0, -9.81]\ninputs: {press: {default: " press " N, unit: N}}\n" INCLUDE(                              \
        "winch", "w_",                                                                                                 \
        "ports: {drum: drum.C, sheave: ground.S, load: load.P, shaft: drum, press: press}, set: {friction: " mu        \
        "}") "ground: {points: {O: {at: [0, 0, 0], axes: {z: -y, x: x}}, S: {at: [2, 0, 0.05], axes: {z: -y, x: "      \
             "x}}}}\n"                                                                                                 \
             "bodies:\n  drum: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 2}, points: {C: [0, 0, "    \
             "0]}}\n"                                                                                                  \
             "  load: {joint: {prismatic: z, at: ground}, mass: 100, points: {P: [2.1, 0, -1]}}\n"

/* A block of 200 kg at four falls against 60 kg. */
#define TACKLE(mu)                                                                                                     \
    "gravity: [0, 0, -9.81]\n" INCLUDE(                                                                                \
        "block_and_tackle", "t_",                                                                                      \
        "ports: {end: ground.E, head: ground.H, block: l.C, haul: h.P}, set: "                                         \
        "{friction: " mu                                                                                               \
        "}") "ground: {points: {E: [-0.08, 0, 0], H: {at: [0, 0, 0], axes: {z: -y, x: x}}}}\nbodies:\n"                \
             "  l: {joint: {prismatic: z, at: ground}, mass: 200, points: {C: {at: [0, 0, -2], axes: {z: -y, x: "      \
             "x}}}}\n"                                                                                                 \
             "  h: {joint: {prismatic: -z, at: ground}, mass: 60, points: {P: [-0.08, 0, -1]}}\n"

#define SHAFT                                                                                                          \
    INCLUDE("two_bearing_shaft", "s_", "ports: {seat: ground.P}")                                                      \
    "ground: {points: {P: [0, 0, 0]}}\nbodies:\n" SLIDES("a",                                                          \
                                                         "1") "forces: {f: {at: s_shaft.end, force: [0, 100, 0]}}\n"

#define PLANETS                                                                                                        \
    "  - {file: kempe:planet.yaml, prefix: p, at: arm, repeat: 3, ports: {sun: sun.O, ring: ground.O}, set: {copies: " \
    "3, stiffness: k}}\n"
#define WHEELS                                                                                                         \
    "ground: {points: {O: [0, 0, 0]}}\nbodies:\n"                                                                      \
    "  sun: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1e-3}, points: {O: [0, 0, 0]}}\n"              \
    "  arm: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 5e-3}}\n"

#define RATCHET(torque)                                                                                                \
    INCLUDE("ratchet", "r_", "ports: {wheel: w.C, seat: ground.S}")                                                    \
    "ground: {points: {O: [0, 0, 0], S: {at: [0.056, 0.04, 0], axes: {x: -y, y: x}}}}\nbodies:\n"                      \
    "  w: {joint: {revolute: z, at: ground.O}, mass: 1, inertia: {zz: 2e-3}, points: {C: [0, 0, 0]}}\n"                \
    "forces: {m: {joint: w, torque: " torque "}, drag: {joint: w, torque: \"-0.02*qd(w)\"}}\n"

static const machine machines[] = {
    /* A slot of four follows the pin from 45 deg before the line of the axes on; tan(phi) = s sin(a)/(1 - s cos(a)). */
    {INCLUDE("geneva", "g_",
             "ports: {pin: crank.P, wheel: w.C, hub: w}") "ground: {points: {O: [0, 0, 0], W: [0.1, 0, 0]}}\nbodies:\n"
                                                          "  crank: {joint: {revolute: z, at: ground.O}, mass: 1, "
                                                          "inertia: {zz: 1e-3}, points: {P: "
                                                          "[\"0.1 m*sin(45 deg)\", 0, 0]}}\n"
                                                          "  w: {joint: {revolute: z, at: ground.W}, mass: 1, inertia: "
                                                          "{zz: 2e-4}, points: {C: [0, 0, 0]}}\n"
                                                          "drives: {m: {joint: crank, angle: \"10*t - 90 deg\"}}\n",
     (0.3 + 1.5707963267948966) / 10, "q(w)", -0.78539816339744831 - 0.57215091711003, 1e-9},
    /* The tip of the pawl is 52 mm from the axis of the wheel, 40 mm from its seat: two circles. */
    {RATCHET("2"), 1, "q(w)", 0.0038565746105650, 1e-9},
    /* Ramp of the torque to 20 N m in 0.1 s; both sticks from 17/31 s on, and the load of the joint is then 4.5 N m. */
    {clutch, 1, "force(c_plates)", -4.5, 1e-9},
    {clutch, 1, "c_heat", 512.838709677419, 1e-7},
    {clutch, 0.548387096774194, "qd(a)", 27.741935483871, 1e-8},
    {gas, 0.1, "force(g_force)", -513.9382133706, 1e-9},
    /* Let go at 30 mm compressed: the other extreme of a motion whose half period is not the linear one. */
    {air, 0.351464083359274, "q(a)", 0.0340942333775257, 1e-9},
    /* Thrown at 0.9 m/s: one chamber cavitates, the other one stops it. */
    {cylinder, 0.000198558794393531, "q(a)", 0.000178571428571429, 1e-12},
    {cylinder, 0.00643984965658956, "q(a)", 0.00363299796270165, 1e-10},
    {cylinder, 0.00643984965658956, "c_pressure_a", 21344788.5911292, 0.5},
    /* The optimum of a viscous ring with a fifth of the inertia: the largest amplitude is 1 + 2/0.2 of the static one.
     */
    {damper, 8, "amplitude", 11, 1e-6},
    /* Eytelwein's factor of half a turn and 0.2. */
    {BAND("0.8744"), 0.1, "qdd(a)", 0, 1e-12},
    {BAND("1"), 0.1, "qdd(a)", (1 - 0.87445608758534) / 0.1, 1e-10},
    {BAND("-0.4665"), 0.1, "qdd(a)", 0, 1e-12},
    {BAND("-1"), 0.1, "qdd(a)", -(1 - (1 - 0.533488091091103)) / 0.1, 1e-10},
    {FREEWHEEL("2", "-0.5"), 0.1, "qdd(b)", 1.5 / 0.4, 1e-10},
    {FREEWHEEL("-1", "0.5"), 0.1, "qdd(b)", (0.5 - 0.25) / 0.3, 1e-10},
    {FREEWHEEL("-1", "0.5"), 0.1, "qdd(a)", (-1 + 0.25) / 0.1, 1e-10},
    {DRUM("mu: 0.35", "100"), 0.01, "qdd(a)", -(0.756 / 0.055 + 0.756 / 0.125) / 0.1, 1e-9},
    {DRUM("leading: 2, trailing: 0", "100"), 0.01, "qdd(a)", -2 * 0.756 / 0.055 / 0.1, 1e-9},
    {DRUM("leading: 2, trailing: 0", "-100"), 0.01, "qdd(a)", 2 * 0.756 / 0.125 / 0.1, 1e-9},
    {"inputs: {press: {default: 100 N, unit: N}}\n" INCLUDE(
         "cone_clutch", "c_", "ports: {A: a, B: b, press: press}") "bodies:\n" TURNS("a", "0.1")
         TURNS("b", "0.3") "start: {qd: {a: 100}}\n",
     0.01, "qdd(a)", -9.619468689488262 / 0.1, 1e-9},
    {DIFFERENTIAL("0"), 0.1, "qdd(r)", 38.28125, 1e-10},
    {DIFFERENTIAL("0"), 0.1, "qdd(l)", 30.46875, 1e-10},
    {DIFFERENTIAL("10"), 0.1, "qdd(l)", 30 / 0.85, 1e-10},
    /* sqrt(1000*(1/0.1 + 1/0.3)) rad/s; with play the first half of it is free. */
    {COUPLING("0"), 0.01, "angle", 0.007921308858121229, 1e-10},
    {COUPLING("1 deg"), 0.015, "angle", 0.014465576738021544, 1e-10},
    {CHAIN(""), 0.1, "qdd(a)", 1 / (0.1 + 0.3 * 17 * 17 / (38. * 38.)), 1e-10},
    {CHAIN("a: 100"), 1e-9, "c_fastest", 3.4557913813624, 1e-7},
    {CHAIN("a: 100"), 1e-9, "c_slowest", 3.39694996599871, 1e-7},
    {INCLUDE("belt_drive", "t_", "ports: {A: a, B: b}, set: {stiffness: 152351.014835708}") "bodies:\n" TURNS(
         "a", "2e-4") TURNS("b", "5e-3") "forces: {m: {joint: a, torque: 4}}\n",
     0.01, "q(a)", 0.193991010103320, 1e-11},
    {WINCH("0", "0"), 0.1, "qdd(load)", -5.19352941176471, 1e-10},
    {WINCH("0", "0"), 0.1, "w_tension", 461.647058823529, 1e-9},
    {WINCH("2500", "0"), 0.1, "qdd(load)", 0, 1e-10},
    {WINCH("2500", "0"), 0.1, "w_tension", 981, 1e-8},
    /* T of the load is exp(mu pi/2) times the tension J a/r^2 of the drum: a = m g/(m + e J/r^2). */
    {WINCH("0", "0.1"), 0.1, "qdd(load)", -4.80863749591091, 1e-10},
    {TACKLE("0"), 0.1, "qdd(h)", 98.1 / 72.5, 1e-10},
    /* With x = exp(-0.01 pi) the falls have s T, T of the hauled part, s = x + x^2 + x^3 + x^4. */
    {TACKLE("0.01"), 0.1, "qdd(h)", 0.7937391242834586, 1e-9},
    {INCLUDE("planetary", "p_", "ports: {sun: s, ring: r, carrier: c}") "bodies:\n" TURNS("s", "1e-3") TURNS("r", "1")
         TURNS("c", "5e-3") "forces: {m: {joint: s, torque: 1}}\ndrives: {fixed: {joint: r, locked: yes}}\n",
     0.01, "qdd(s)", 1 / (1e-3 + 5e-3 / 16), 1e-8},
    /* Willis with the masses of three planets: the arm has a quarter, a planet minus half of the sun's rate. */
    {"parameters: {k: 0 N/m}\ninclude:\n" PLANETS WHEELS "forces: {m: {joint: sun, torque: 1}}\n", 0.01, "qdd(sun)",
     1 / (1e-3 + (5e-3 + 3 * 0.3 * 0.048 * 0.048) / 16 + 3 * 1e-4 / 4), 1e-8},
    /* All of the energy is in the stop at the largest depth: 25000 x^2 + 31250000 x^4 = 5. */
    {INCLUDE("bump_stop", "s_", "ports: {P: ground.P, Q: a.Q}") "ground: {points: {P: [-0.2, 0, 0]}}\nbodies:\n" SLIDES(
         "a", "10") "start: {qd: {a: -1}}\nrun: {until: \"qd(a) > 0\"}\n",
     1, "s_depth", 0.012871885058111654, 1e-9},
    {INCLUDE("rubber_bouc_wen", "r_",
             "ports: {P: ground.P, Q: a.Q}") "ground: {points: {P: [-0.1, 0, "
                                             "0]}}\nbodies:\n" SLIDES("a", "1") "drives: {m: {joint: a, "
                                                                                "displacement: 0.01*t}}\n",
     0.1, "r_hysteresis", 80 * (1 - 0.36787944117144233), 1e-6},
    {"tables: {c: {x: [-1, 0, 1], y: [-300, 0, 100], method: linear}}\n" INCLUDE(
         "table_damper", "d_", "ports: {P: ground.P, Q: a.Q, curve: c}") "ground: {points: {P: [-0.5, 0, "
                                                                         "0]}}\nbodies:\n" SLIDES("a",
                                                                                                  "1") "drives: {m: "
                                                                                                       "{joint: a, "
                                                                                                       "displacement: "
                                                                                                       "-0.5*t}}\n",
     0.1, "force(d_force)", -150, 1e-9},
    {"inputs: {flow: {default: 1e-4}}\n" INCLUDE("accumulator", "a_", "ports: {flow: flow}") "bodies:\n" SLIDES("a",
                                                                                                                "1"),
     2, "a_shown", 13070494.407390915, 0.01},
    {"inputs: {u: {default: 12}}\n" INCLUDE("dc_motor", "m_", "ports: {J: a, voltage: u}") "bodies:\n" TURNS("a",
                                                                                                             "1e-3"),
     0.1, "qd(a)", 93.68030421090015, 1e-8},
    {INCLUDE("seal_friction", "s_", "ports: {J: a}") "bodies:\n" SLIDES("a",
                                                                        "1") "forces: {p: {joint: a, force: 200}}\n",
     0.5, "qd(a)", 1.5, 1e-9},
    {"inputs: {valve: {default: 1}, supply: {default: 10 MPa, unit: Pa}}\n" INCLUDE(
         "hydraulic_cylinder", "c_",
         "ports: {J: a, valve: valve, supply: supply}, set: {flow: 5e-6, volume: 5000 cm^3}") "bodies:\n" SLIDES("a",
                                                                                                                 "20"),
     0.15, "qd(a)", 5.590164353593506, 1e-6},
    {SHAFT, 0.1, "s_radial_1", 50, 1e-10},
    {SHAFT, 0.1, "s_radial_2", 150, 1e-10},
};

/* The value of an output at the end. */
static double at_end(const kempe_trajectory *run, const char *output)
{
    kempe_table *table = NULL;
    CHECK(run && kempe_trajectory_outputs(run, output, &table) == KEMPE_OK);
    const double x = table ? kempe_table_number(table, kempe_table_row_count(table) - 1, 1) : NAN;
    kempe_table_free(table);
    return x;
}

static void machines_have_their_digits(void)
{
    static const int some[] = {0, 3, 5}; /* of `ways`: one of each formulation */
    for (size_t i = 0; i < sizeof machines / sizeof *machines; i++) {
        char text[2048];
        (void)snprintf(text, sizeof text, "kempe: 1\n%s%s", machines[i].text,
                       strstr(machines[i].text, "run: ") ? "" : "run: {t_end: 1}\n");
        for (size_t k = 0; k < sizeof some / sizeof *some; k++) {
            const way *by = &ways[some[k]];
            const double wanted = machines[i].wanted, loose = fmax(1, fabs(wanted)) * by->tolerance;
            loaded l = load_text(text);
            kempe_trajectory *run = simulate(&l, by, machines[i].t_end);
            const double found = at_end(run, machines[i].output);
            if (!(fabs(found - wanted) <= fmax(machines[i].tolerance, loose)))
                printf("%zu %s %s\n%s", i, by->formulation, machines[i].output, text);
            CHECK_NEAR(found, wanted, fmax(machines[i].tolerance, loose));
            kempe_trajectory_free(run);
            unload(&l);
        }
    }
}

int main(void)
{
    TEST(machines_have_their_digits);
    return check_report();
}
