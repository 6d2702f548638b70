/* SPDX-License-Identifier: BSD-3-Clause */
/* Friction by coefficients and reactions: of joints of the tree, of loops, in the plane and in space, against digits,
 * closed forms and the same mechanism with its joint cut; and what is said of levels that grow with the friction. */
#include "ways.h"
#include <math.h>

static kempe_trajectory *run_by(const loaded *l, const char *formulation, double t_end)
{
    kempe_status status;
    return simulate_any(l, &(way){.formulation = formulation}, t_end, &status);
}

static void check_entry(const kempe_trajectory *run, int k, double t, const char *text)
{
    const kmp_log_entry *at = entry(run, "friction", k);
    CHECK(at != NULL);
    if (at) {
        CHECK_NEAR(at->t, t, 1e-9);
        CHECK_TEXT(at->text, text);
    }
}

/* F7 with the reaction of the guide, a joint of the tree, in place of its law. */
static void a_guide_of_the_tree(void)
{
    static const char *const formulations[] = {"reduced", "projected"};
    for (int k = 0; k < 2; k++) {
        loaded l = load("tests/models/friction_guide_mu.yaml");
        kempe_trajectory *run = run_by(&l, formulations[k], 1);
        if (run) {
            check_entry(run, 1, 0.1199069592433703, "'guide' slips forward");
            check_entry(run, 3, 0.517173110411307, "'guide' sticks");
            CHECK_NEAR(last_q(run)[coordinate_named(&l, "th")], 7.667684321805424, 1e-9);
        }
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* F9: a pin that closes a loop. */
static void a_pin_of_a_loop(void)
{
    loaded l = load_text("kempe: 1\n"
                         "gravity: [0, -9.81, 0]\n"
                         "ground: {points: {D: [0.9, 0, 0]}}\n"
                         "bodies:\n"
                         "  crank:   {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.15, 0, 0], "
                         "inertia: {zz: 0.09/12}, points: {B: [0.3, 0, 0]}}\n"
                         "  coupler: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, com: [0.4, 0, 0], "
                         "inertia: {zz: 0.64/12}, points: {C: [0.8, 0, 0]}}\n"
                         "  rocker:  {joint: {name: D, revolute: z, at: ground.D}, mass: 1, com: [0.35, 0, 0], "
                         "inertia: {zz: 0.49/12}, points: {C: [0.7, 0, 0]}}\n"
                         "loops: {C: {ball: [coupler.C, rocker.C]}}\n"
                         "forces:\n"
                         "  pin: {sliding: q(A) + q(B) - q(D), friction: {mu: 0.5, radius: 0.2 m, reaction: C}}\n"
                         "start: {q: {A: 90 deg, B: -45 deg, D: 90 deg}, hold: [A], qd: {A: 1.5}}\n"
                         "run: {t_end: 10}\n");
    kempe_trajectory *run = run_by(&l, "reduced", 10);
    if (run) {
        check_entry(run, 1, 0.392683606439903, "'pin' slips forward");
        check_entry(run, 3, 0.874660819817614, "'pin' slips forward");
        CHECK_NEAR(last_q(run)[0], 4.457798148496, 1e-9);
    }
    kempe_trajectory_free(run);
    unload(&l);
}

/* The pin of a pendulum as a joint of the tree, and cut: a planar joint and a loop. */
static void a_pin_of_the_tree(void)
{
    loaded tree = load_text("kempe: 1\n"
                            "gravity: [0, -9.81, 0]\n"
                            "bodies: {bob: {joint: {name: th, revolute: z, at: ground}, mass: 1, com: [0, -1, 0], "
                            "inertia: {zz: 0.1}}}\n"
                            "forces: {rub: {joint: th, friction: {mu: 0.3, mu_static: 0.4, radius: 20 cm}}}\n"
                            "start: {q: {th: 1.5}}\n");
    loaded loop = load_text("kempe: 1\n"
                            "gravity: [0, -9.81, 0]\n"
                            "ground: {points: {O: [0, 0, 0]}}\n"
                            "bodies: {bob: {joint: {name: j, planar: z, at: ground}, mass: 1, com: [0, -1, 0], "
                            "inertia: {zz: 0.1}, points: {O: [0, 0, 0]}}}\n"
                            "loops: {C: {ball: [ground.O, bob.O]}}\n"
                            "forces: {rub: {joint: j.3, friction: {torque: \"0.06*sqrt(lambda(C.1)^2+lambda(C.2)^2)*(1 "
                            "m)\", static: \"0.08*sqrt(lambda(C.1)^2+lambda(C.2)^2)*(1 m)\"}}}\n"
                            "start: {q: {j.3: 1.5}, hold: [j.3]}\n");
    kempe_trajectory *a = run_by(&tree, "reduced", 12), *b = run_by(&loop, "projected", 12);
    for (int k = 0; a && b && entry(a, "friction", k); k++) {
        const kmp_log_entry *other = entry(b, "friction", k);
        check_entry(a, k, other ? other->t : NAN, other ? other->text : "");
    }
    CHECK(a && b && entry(a, "friction", 5));
    if (a && b)
        CHECK_NEAR(last_q(a)[coordinate_named(&tree, "th")], last_q(b)[coordinate_named(&loop, "j.3")], 1e-9);
    kempe_trajectory_free(a);
    kempe_trajectory_free(b);
    unload(&tree);
    unload(&loop);
}

/* A balanced rotor stops after J w/(mu r m g), a block on a slide in space after v/(mu g cos - g sin). */
static void closed_forms(void)
{
    loaded rotor = load_text("kempe: 1\n"
                             "gravity: [0, 0, -9.81]\n"
                             "bodies: {rotor: {joint: {name: A, revolute: x, at: ground}, mass: 3, inertia: "
                             "{xx: 0.02, yy: 0.02, zz: 0.02}}}\n"
                             "forces: {rub: {joint: A, friction: {mu: 0.2, radius: 10 mm}}}\n"
                             "start: {qd: {A: 5}}\n");
    loaded slide = load_text("kempe: 1\n"
                             "gravity: [0, 0, -9.81]\n"
                             "bodies: {block: {joint: {name: s, prismatic: [sqrt(3)/2, 0, -0.5], at: ground}, mass: "
                             "3}}\n"
                             "forces: {rub: {joint: s, friction: {mu: 0.7}}}\n"
                             "start: {qd: {s: 1}}\n");
    kempe_trajectory *run = run_by(&rotor, "reduced", 5);
    if (run)
        check_entry(run, 1, 0.02 * 5 / (0.2 * 0.01 * 3 * 9.81), "'rub' sticks");
    kempe_trajectory_free(run);
    run = run_by(&slide, "reduced", 5);
    if (run)
        check_entry(run, 1, 1 / (0.7 * 9.81 * cos(3.14159265358979323846 / 6) - 9.81 / 2), "'rub' sticks");
    kempe_trajectory_free(run);
    unload(&rotor);
    unload(&slide);
}

/* A block of 20 kg on a slide along x, pressed across the plane of a mechanism by its weight, by that of a fan on it,
 * by a force; a fan elsewhere changes nothing. It stops after m v/(mu N). */
static void pressed_across_the_plane(void)
{
#define ON_SLIDE(gravity, at, press)                                                                                   \
    "kempe: 1\n"                                                                                                       \
    "gravity: " gravity "\n"                                                                                           \
    "ground: {points: {far: [10, 0, 0], S: [0, 0, 1]}}\n"                                                              \
    "bodies:\n"                                                                                                        \
    "  block: {joint: {name: X, prismatic: [0.6, 0.8, 0], at: ground.S}, mass: 20, points: {P: [0, 0, 0]}}\n"          \
    "  fan: {joint: {name: C, revolute: z, at: " at "}, mass: 2, inertia: {zz: 0.1}}\n"                                \
    "forces: {rub: {joint: X, friction: {mu: 0.1}}" press "}\n"                                                        \
    "start: {qd: {X: 0.2}}\n"
    static const struct {
        const char *text;
        double mass, normal;
    } cases[] = {{ON_SLIDE("[0, 0, -9.81]", "ground.far", ""), 20, 20 * 9.81},
                 {ON_SLIDE("[0, 0, -9.81]", "block.P", ""), 22, 22 * 9.81},
                 {ON_SLIDE("[0, 0, 0]", "ground.far", ", push: {at: block.P, force: [0, 0, 50 N]}"), 20, 50},
                 {ON_SLIDE("[0, 0, 0]", "block.P", ", push: {at: block.P, force: [0, 0, 50 N]}"), 22, 50}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        loaded l = load_text(cases[k].text);
        kempe_trajectory *run = run_by(&l, "reduced", 2);
        if (run)
            check_entry(run, 1, cases[k].mass * 0.2 / (0.1 * cases[k].normal), "'rub' sticks");
        kempe_trajectory_free(run);
        unload(&l);
    }
}

/* The slide of a slider-crank that lies flat holds a push of less than mu times its weight. */
static void flat_slider_crank(void)
{
#define FLAT(push)                                                                                                     \
    "kempe: 1\n"                                                                                                       \
    "gravity: [0, 0, -9.81]\n"                                                                                         \
    "bodies:\n"                                                                                                        \
    "  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.01}, points: {B: [0.1, 0, 0]}}\n"   \
    "  rod: {joint: {name: B, revolute: z, at: crank.B}, mass: 1, inertia: {zz: 0.01}, points: {C: [0.3, 0, 0]}}\n"    \
    "  slider: {joint: {name: S, prismatic: x, at: ground}, mass: 5, points: {C: [0, 0, 0]}}\n"                        \
    "loops: {C: {ball: [rod.C, slider.C]}}\n"                                                                          \
    "forces: {rub: {joint: S, friction: {mu: 0.3}}, push: {joint: S, force: " push "}}\n"                              \
    "start: {q: {A: 60 deg, B: -80 deg, S: 0.33}, hold: [A]}\n"
    loaded held = load_text(FLAT("14.71 N")), pushed = load_text(FLAT("14.72 N")); /* 0.3 5 9.81 N = 14.715 N */
    kempe_trajectory *a = run_by(&held, "reduced", 1), *b = run_by(&pushed, "reduced", 1);
    if (a && b) {
        CHECK_TEXT(entry(a, "friction", 0)->text, "'rub' sticks");
        CHECK(!entry(a, "friction", 1));
        CHECK_TEXT(entry(b, "friction", 0)->text, "'rub' slips forward");
    }
    kempe_trajectory_free(a);
    kempe_trajectory_free(b);
    unload(&held);
    unload(&pushed);
}

/* Joints with several coordinates: a sleeve that slides and turns on a bar, a block on a table, a ball in its socket.
 * In each direction they stop after v/(mu g), or J w/(mu r m g). */
static void several_coordinates(void)
{
    loaded l =
        load_text("kempe: 1\n"
                  "gravity: [0, 0, -10]\n"
                  "bodies:\n"
                  "  sleeve: {joint: {name: C, cylindrical: x, at: ground}, mass: 3, inertia: {xx: 0.02, yy: 0.02, "
                  "zz: 0.02}}\n"
                  "  block: {joint: {name: P, planar: z, at: ground}, mass: 2, inertia: {zz: 0.1}}\n"
                  "  ball: {joint: {name: S, spherical: z, at: ground}, mass: 4, inertia: {xx: 0.1, yy: 0.1, zz: "
                  "0.1}}\n"
                  "forces:\n"
                  "  slide: {joint: C.1, friction: {mu: 0.1}}\n"
                  "  turn: {joint: C.2, friction: {mu: 0.2, radius: 10 mm}}\n"
                  "  rub: {joint: P.2, friction: {mu: 0.3}}\n"
                  "  socket: {joint: S.1, friction: {mu: 0.05, radius: 5 cm}}\n"
                  "start: {qd: {C.1: 0.5, C.2: 2, P.2: -2.4, S.1: 1}}\n");
    const struct {
        double t;
        const char *text;
    } stops[] = {{0.5 / (0.1 * 10), "'slide' sticks"},
                 {0.02 * 2 / (0.2 * 0.01 * 3 * 10), "'turn' sticks"},
                 {2.4 / (0.3 * 10), "'rub' sticks"},
                 {0.1 * 1 / (0.05 * 0.05 * 4 * 10), "'socket' sticks"}};
    kempe_trajectory *run = run_by(&l, "reduced", 2);
    for (int k = 0; run && k < 4; k++)
        check_entry(run, 4 + k, stops[k].t, stops[k].text);
    kempe_trajectory_free(run);
    unload(&l);
}

static void check_words(const char *path, const kempe_setting *settings, int count, double growth, bool solved)
{
    char words[64];
    loaded l = load_set(path, settings, count);
    kempe_trajectory *run = run_by(&l, "reduced", 0.001);
    (void)snprintf(words, sizeof words, "grows by %.4g for each", growth);
    if (run) {
        const kmp_log_entry *grows = entry(run, "growth", 0), *two = entry(run, "solutions", 0);
        CHECK((grows != NULL) == (growth >= 1));
        CHECK(!grows || strstr(grows->text, words));
        CHECK(solved == (kempe_trajectory_reason(run)[0] == 0));
        CHECK((two != NULL) == (solved && growth >= 1));
        CHECK(solved || (strstr(kempe_trajectory_reason(run), "can neither slip nor stick at t = 0") &&
                         strstr(kempe_trajectory_reason(run), words)));
    }
    kempe_trajectory_free(run);
    unload(&l);
}

/* Two solutions and none: the slider-crank at 300 deg with mu = 10; a rod on rough ground at 45 deg beyond 5/3, where
 * the level grows by 3 mu/5. */
static void two_solutions_or_none(void)
{
    const char *const guide = "tests/models/friction_guide.yaml", *const rod = "tests/models/friction_rod.yaml";
    check_words(guide, (const kempe_setting[]){{"th0", "300 deg"}, {"mu", "10"}, {"w", "15"}}, 3, 1.366, true);
    check_words(guide, (const kempe_setting[]){{"th0", "300 deg"}, {"mu", "10"}, {"w", "-15"}}, 3, 1.366, false);
    for (int k = 0; k < 2; k++) {
        const char *const v[] = {"1", "-1"};
        check_words(rod, (const kempe_setting[]){{"mu", "1.66"}, {"v", v[k]}}, 2, 0.996, true);
        check_words(rod, (const kempe_setting[]){{"mu", "1.67"}, {"v", v[k]}}, 2, 1.002, k == 0);
    }
}

/* A motion as a whole at whose start no modes are possible: why. */
static void check_cause(const char *text, const char *words)
{
    loaded l = load_text(text);
    kempe_trajectory *run = NULL;
    const kempe_run_options options = {.t_end = 0.01, .max_steps = 1000000, .no_convergence_check = 1};
    CHECK(l.system && kempe_simulate(l.system, &options, &run) == KEMPE_E_FAILED);
    const char *reason = run ? kempe_trajectory_reason(run) : "";
    if (!strstr(reason, words))
        printf("%s\n", reason);
    CHECK(strstr(reason, "can neither slip nor stick at t = 0 s: ") && strstr(reason, words));
    kempe_trajectory_free(run);
    unload(&l);
}

/* Rods of Painleve beside each other, pushed by 20 N: neither slip nor stick. */
static void check_rods(int count, const char *words)
{
    char text[8192];
    size_t at = (size_t)snprintf(text, sizeof text,
                                 "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n");
#define PUT(...) at += (size_t)snprintf(text + at, sizeof text - at, __VA_ARGS__)
    for (int i = 0; i < count; i++)
        PUT("  r%d: {joint: {name: j%d, planar: z, at: ground}, mass: 1, inertia: {zz: 1/12}, points: {O: [0, 0, 0], "
            "P: [-0.5, 0, 0]}}\n",
            i, i);
    PUT("loops:\n");
    for (int i = 0; i < count; i++)
        PUT("  tip%d: {point_on_plane: [ground.O, r%d.P], axis: y}\n", i, i);
    PUT("forces:\n");
    for (int i = 0; i < count; i++)
        PUT("  rub%d: {sliding: position(r%d.P).x, friction: {mu: 10/3, reaction: tip%d}}\n"
            "  push%d: {at: r%d.O, force: [20, 0, 0]}\n",
            i, i, i, i, i);
    PUT("start: {q: {");
    for (int i = 0; i < count; i++)
        PUT("%sj%d.3: 45 deg, j%d.2: 0.5 m*sin(45 deg)", i ? ", " : "", i, i);
    PUT("}, hold: [");
    for (int i = 0; i < count; i++)
        PUT("%sj%d.3", i ? ", " : "", i);
    PUT("]}\n");
#undef PUT
    check_cause(text, words);
}

#define BESIDE(i) "  c" #i ": {joint: {name: c" #i ", prismatic: x, at: ground}, mass: 1}\n"
#define RUBS(i)   "  h" #i ": {joint: c" #i ", friction: {force: 1 N}}\n"

static void why_no_modes(void)
{
    check_rods(2, "the level of 'rub0' grows by 2 for each unit of friction, and only below 1 a solution is certain, "
                  "and none of 9 combinations of slip and stick agrees with the forces");
    check_rods(7, "grows by 2 for each unit of friction, and only below 1 a solution is certain, and 7 friction "
                  "elements have too many combinations of slip and stick to try");
    /* Slip of both is accelerated at their static levels, and slip of the first one reversed at those of slip. */
    check_cause("kempe: 1\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                "  a: {joint: {name: a, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
                "  b: {joint: {name: b, prismatic: y, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n" BESIDE(0)
                    BESIDE(1) BESIDE(2) BESIDE(3) BESIDE(
                        4) "forces:\n"
                           "  f: {sliding: q(a), friction: {force: 1 N}}\n"
                           "  g: {sliding: \"0.9*q(a) + sqrt(0.19)*q(b)\", friction: {force: 0.1 N, static: 1 N}}\n"
                           "  u: {at: a.P, force: [0.5, 0, 0]}\n"
                           "  v: {at: b.P, force: [0, \"-0.65/sqrt(0.19)\", 0]}\n" RUBS(0) RUBS(1) RUBS(2) RUBS(3)
                               RUBS(4),
                "sliding friction would reverse the slip as it begins, and 7 friction elements have too many "
                "combinations of slip and stick to try");
    /* A rod in space that slides on its tip. */
    check_cause("kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
                "  rod: {joint: {name: j, free: z, at: ground}, mass: 1, inertia: {xx: 0.001, yy: 1/12, zz: 1/12},\n"
                "        points: {P: [-0.5, 0, 0]}}\n"
                "contacts: {tip: {point: rod.P, on: {plane: ground.O}, restitution: 0, friction: 3}}\n"
                "start: {q: {j.1: 0.5 m*sin(45 deg), j.6: -45 deg}, qd: {j.2: 1}}\n",
                "the friction levels depend too strongly on the friction forces to settle, and combinations of slip in "
                "two directions cannot be tried one by one");
}

static kempe_trajectory *fall_back(const char *text, const char *formulation, double t_end, loaded *l)
{
    *l = load_text(text);
    return run_by(l, formulation, t_end);
}

#define ROD(push)                                                                                                      \
    "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: {at: [0, 0, 0]}}}\nbodies:\n"                              \
    "  rod: {joint: {name: j, planar: z, at: ground}, mass: 1, inertia: {zz: 1/12}, points: {O: [0, 0, 0], P: [-0.5, " \
    "0, 0]}}\n"                                                                                                        \
    "loops: {tip: {point_on_plane: [ground.O, rod.P], axis: y}}\n"                                                     \
    "forces:\n  rub: {sliding: position(rod.P).x, friction: {mu: 10/3, reaction: tip, regularise: 1 mm/s}}\n"          \
    "  push: {at: rod.O, force: [" push ", 0, 0]}\n"                                                                   \
    "start: {q: {j.3: 45 deg, j.2: 0.5 m*sin(45 deg)}, hold: [j.3]}\n"

/* The fall-back. F10, Painleve's rod at 45 deg from rest with mu = 10/3: a push of 60 N leaves three modes, where the
 * reaction grows by 2; with a push backward it sticks alone. Digits of the regularised law by Runge-Kutta in steps of
 * 50 ns, with the normal force in closed form. At 0.1 m/s it leaves. */
static void regularised_where_modes_are_not_unique(void)
{
    static const char *const formulations[] = {"reduced", "projected"};
    for (int k = 0; k < 2; k++) {
        loaded l;
        kempe_trajectory *run = fall_back(ROD("60"), formulations[k], 0.0021198392315470707, &l);
        if (run) {
            check_entry(run, 0, 0,
                        "'rub' is regularised: no combination of slip and stick is possible, or several are");
            CHECK_NEAR(last_q(run)[2], 0.7853442947891244, 1e-9);
            CHECK_NEAR(last_qd(run)[2], -0.05089669137730652, 1e-7);
            CHECK(kempe_trajectory_reason(run)[0] == 0);
        }
        kempe_trajectory_free(run);
        unload(&l);
        run = fall_back(ROD("60"), formulations[k], 0.01, &l);
        const kmp_log_entry *left = run ? entry(run, "regularised", 0) : NULL;
        CHECK(left != NULL);
        if (left) {
            CHECK_NEAR(left->t, 0.0021198392315470707, 1e-9);
            CHECK(strstr(left->text, "'rub' was regularised from t = 0 to 0.00211983923"));
            check_entry(run, 1, left->t, "'rub' slips forward");
        }
        kempe_trajectory_free(run);
        unload(&l);
        run = fall_back(ROD("-10"), formulations[k], 0.001, &l);
        check_entry(run, 0, 0, "'rub' sticks");
        kempe_trajectory_free(run);
        unload(&l);
    }
}

static kempe_trajectory *push_crank(double torque, double t_end, loaded *l)
{
    char text[1200];
    (void)snprintf(
        text, sizeof text,
        "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {th0: 300 deg}\nbodies:\n"
        "  crank:  {joint: {name: th, revolute: z, at: ground}, mass: 1, com: [0.05, 0, 0], inertia: {zz: 0.01/12}, "
        "points: {B: [0.1, 0, 0]}}\n"
        "  rod:    {joint: {name: B, revolute: z, at: crank.B}, mass: 0.6, com: [0.15, 0, 0], inertia: {zz: 0.054/12}, "
        "points: {P: [0.3, 0, 0]}}\n"
        "  slider: {joint: {name: x, prismatic: x, at: ground}, mass: 0.8, points: {P: [0, 0, 0]}}\n"
        "loops: {C: {ball: [rod.P, slider.P]}}\nforces:\n"
        "  guide: {joint: x, friction: {force: 10*abs(0.8*9.81-lambda(C.2)), regularise: 1 mm/s}}\n"
        "  motor: {joint: th, torque: %g}\n"
        "start: {q: {th: th0, B: '-th0 - asin(sin(th0)/3)', x: 0.35}, hold: [th]}\n",
        torque);
    return fall_back(text, "reduced", t_end, l);
}

/* F7 with mu = 10 from rest at 300 deg: with 3 N m on the crank it sticks alone; 4.5 N m leave several modes, and it
 * goes on where the guide carries a load upward. */
static void regularised_guide(void)
{
    loaded l;
    kempe_trajectory *run = push_crank(3, 0.05, &l);
    check_entry(run, 0, 0, "'guide' sticks");
    kempe_trajectory_free(run);
    unload(&l);
    run = push_crank(4.5, 0.05, &l);
    if (run) {
        const kmp_log_entry *left = entry(run, "regularised", 0), *grows = entry(run, "growth", 0);
        check_entry(run, 0, 0, "'guide' is regularised: no combination of slip and stick is possible, or several are");
        CHECK(left && left->before == 0 && strstr(left->text, "'guide' was regularised from t = 0 to 0.0073409"));
        check_entry(run, 1, left ? left->t : 0, "'guide' slips forward");
        CHECK(grows && strstr(grows->text, "grows by 1.366 for each"));
        CHECK(0.8 * 9.81 - last_lambda(run)[1] > 0 && last_qd(run)[2] > 0);
    }
    kempe_trajectory_free(run);
    unload(&l);
}

int main(void)
{
    TEST(a_guide_of_the_tree);
    TEST(a_pin_of_a_loop);
    TEST(a_pin_of_the_tree);
    TEST(closed_forms);
    TEST(pressed_across_the_plane);
    TEST(flat_slider_crank);
    TEST(several_coordinates);
    TEST(two_solutions_or_none);
    TEST(why_no_modes);
    TEST(regularised_where_modes_are_not_unique);
    TEST(regularised_guide);
    return check_report();
}
