/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: ensemble */
/* ctest: slow not_sanitized 12 */
/* Conditions and kinks of instances in lanes, and what they decide at the site of an engine: friction that sticks,
 * rigid contacts, states that take next values, forces that depend on multipliers, points on curves. The same bits
 * whatever the number of lanes and threads, the motions of separate runs and of closed forms, ends by conditions, and
 * conditions that change back and forth. */
#include "full.h"
#include "varied_models.h"

static const kmp_ensemble_execution ways[] = {{.width = 1},
                                              {.width = 1, .plain = true},
                                              {.width = 4},
                                              {.width = 3},
                                              {.width = 8, .plain = true},
                                              {.threads = 2, .width = 4},
                                              {.threads = 1, .width = 2, .pools = 1},
                                              {.threads = 3, .width = 1}};

/* Runs the instances in lanes in all ways, ./check in every third one, another for each call; the results of the first
 * are left in `first`. */
static void in_all_ways(many *x, const kmp_run_spec *spec, outcome *first)
{
    static outcome other;
    static size_t call;
    run(x, spec, (kmp_ensemble_execution){.width = 8}, first);
    const size_t step = check_full() ? 1 : 3;
    for (size_t k = call++ % step; k < sizeof ways / sizeof *ways; k += step) {
        run(x, spec, ways[k], &other);
        CHECK(differ(x, first, &other) == 0);
        drop(&other);
    }
}

typedef struct motion {
    const char *name, *text; /* text NULL: a file of tests/models */
    const char *varied[MOST];
    double spread, t_end, near;
    int parts; /* separate runs make a part of some instance */
} motion;

static many gather_motion(const motion *m)
{
    char path[1024];
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    (void)snprintf(path, sizeof path, "%s/tests/models/%s.yaml", KEMPE_ROOT, m->name);
    (void)(m->text ? kempe_model_read_text(context, m->text, "model.yaml", &model)
                   : kempe_model_read(context, path, &model));
    return gather_from(context, model, m->varied, m->spread);
}

#define EXAMPLES "../../examples/"
#define BALL(law)                                                                                                      \
    "kempe: 1\ngravity: [0, -9.81, 0]\nparameters: {k: 4000, m: 2}\n"                                                  \
    "bodies: {ball: {joint: {name: S, prismatic: y, at: ground}, mass: m}}\n"                                          \
    "forces: {stop: {joint: S, force: \"" law "\"}}\nstart: {q: {S: 0.5}}\n"

static const char window[] =
    "kempe: 1\nname: window\ngravity: [0, -9.81, 0]\nparameters: {r: 0.3, l: 0.8, rocker: 0.7, d: 0.9, place: 1.3}\n"
    "ground: {points: {O: [0, 0, 0], D: [d, 0, 0]}}\nbodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {E: [r, 0, 0]}}\n"
    "  b: {joint: {name: b, revolute: z, at: a.E}, mass: 1, inertia: {zz: 1}, points: {E: [l, 0, 0]}}\n"
    "  c: {joint: {name: c, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 1}, points: {E: [rocker, 0, 0]}}\n"
    "loops: {E: {ball: [b.E, c.E]}}\n"
    "forces: {f: {joint: c, torque: \"if(q(c) > place, if(q(c) < place + 0.02, 5, 0), 0)"
    " - if(qd(c) > 0.5, qd(c), 0.5)\"}}\n"
    "start: {q: {a: 1.5, b: -1, c: 1.6}, hold: [a], qd: {a: 3}}\n";

/* Painleve's rod from rest: its friction is regularised, and slips from 2 ms on. */
static const char rod[] =
    "kempe: 1\nname: rod\ngravity: [0, -9.81, 0]\nparameters: {push: 60}\nground: {points: {O: {at: [0, 0, 0]}}}\n"
    "bodies:\n  rod: {joint: {name: j, planar: z, at: ground}, mass: 1, inertia: {zz: 1/12}, "
    "points: {O: [0, 0, 0], P: [-0.5, 0, 0]}}\n"
    "loops: {tip: {point_on_plane: [ground.O, rod.P], axis: y}}\n"
    "forces:\n  rub: {sliding: position(rod.P).x, friction: {mu: 10/3, reaction: tip, regularise: 1 mm/s}}\n"
    "  push: {at: rod.O, force: [push, 0, 0]}\n"
    "start: {q: {j.3: 45 deg, j.2: 0.5 m*sin(45 deg)}, hold: [j.3]}\n";

static const motion motions[] = {
    {"bounce", NULL, {"k", "m", NULL}, 0.1, 3, 1e-6, 0},
    {"braked", NULL, {"q.S", NULL}, 0.1, 4, 1e-6, 0},
    {"pendulum_stops", NULL, {"q.A", NULL}, 0.1, 2, 1e-6, 0},
    {"slider_stop", NULL, {"qd.A", NULL}, 0.05, 1, 1e-6, 0},
    {"parallelogram_switch", NULL, {"qd.A", NULL}, 0.01, 1, 1e-5, 1},
    {"friction_belt", NULL, {"qd.s", NULL}, 0.1, 12, 1e-6, 0},
    {"friction_falling", NULL, {"q.s", "qd.s", NULL}, 0.1, 12, 1e-6, 0},
    {"friction_incline", NULL, {"mu", "g", NULL}, 0.05, 3, 1e-6, 0},
    {"friction_pair", NULL, {"th0", NULL}, 0.1, 1, 1e-6, 0},
    {"friction_pendulum", NULL, {"q.th", NULL}, 0.1, 7, 1e-6, 0},
    {"friction_stack", NULL, {"g", NULL}, 0.05, 10, 1e-6, 0},
    {"contact_bounce", NULL, {"q.z", NULL}, 0.1, 5, 1e-6, 0},
    {"contact_corners", NULL, {"q.b.2", "qd.b.2", NULL}, 0.05, 1.25, 1e-6, 0},
    {"contact_slider_crank", NULL, {"crank_mass", "rod_mass", NULL}, 0.05, 1, 1e-6, 0},
    {"sampled_slide", NULL, {"q.x", NULL}, 0.1, 2.03, 1e-6, 0},
    {"guide_friction", NULL, {"r", "mu", NULL}, 0.01, 1, 1e-5, 0},
    {"friction_guide", NULL, {"mu", "w", NULL}, 0.05, 1, 1e-6, 0},
    {"friction_rod", NULL, {"mu", "v", NULL}, 0.02, 0.01, 1e-6, 0},
    {"friction_pin", NULL, {"qd.A", NULL}, 0.05, 3, 1e-6, 0},
    {"contact_incline", NULL, {"mu", "slope", NULL}, 0.05, 2, 1e-6, 0},
    {"contact_oblique", NULL, {"mu", "h", NULL}, 0.02, 0.6, 1e-6, 0},
    {"contact_rolling", NULL, {"slope", "qd.b.1", NULL}, 0.05, 2, 1e-6, 0},
    {"contact_spin", NULL, {"qd.s.4", NULL}, 0.05, 1, 1e-6, 0},
    {"contact_turntable", NULL, {"qd.b.1", NULL}, 0.02, 2, 1e-6, 0},
    {"contact_wall", NULL, {"qd.b.2", NULL}, 0.02, 1, 1e-6, 1},
    {EXAMPLES "stick_slip/stick_slip", NULL, {"U", NULL}, 0.05, 0.5, 1e-6, 0},
    {EXAMPLES "toggle_press/toggle_press", NULL, {"knee_force", NULL}, 0.05, 0.5, 1e-6, 0},
    {EXAMPLES "loose_pin/loose_pin", NULL, {"speed", NULL}, 0.05, 1e-3, 1e-5, 0},
    {EXAMPLES "hydraulic_excavator/hydraulic_excavator", NULL, {"supply", NULL}, 0.01, 0.05, 1e-6, 0},
    {EXAMPLES "jansen_walker/jansen_walker", NULL, {"mu", NULL}, 0.01, 0.2, 1e-6, 0},
    {EXAMPLES "wheelset/wheelset", NULL, {"mu", NULL}, 0.01, 0.004, 1e-6, 0},
    {EXAMPLES "manchester/manchester_wheelset", NULL, {"speed", NULL}, 0.01, 0.002, 1e-6, 0},
    {"kink", BALL("-k*min(q(S), 0)"), {"k", "m", NULL}, 0.1, 3, 1e-6, 0},
    {"drag", BALL("-k*q(S) - 3*qd(S)*abs(qd(S))"), {"k", "m", NULL}, 0.1, 3, 1e-6, 0},
    {"rod", rod, {"push", NULL}, 0.02, 0.2, 1e-6, 1},
    {"window", window, {"place", "rocker", NULL}, 0.01, 3, 1e-6, 0},
};

static void lanes_do_not_matter(void)
{
    static outcome first, other;
    random_seed(11);
    for (size_t k = 0; k < sizeof motions / sizeof *motions; k++) {
        many x = gather_motion(&motions[k]);
        const kmp_run_spec spec = {.rtol = 1e-9, .t_end = motions[k].t_end};
        int parts = 0;
        if (!x.ensemble) {
            scatter(&x);
            continue;
        }
        in_all_ways(&x, &spec, &first);
        CHECK(first.work.alone == 0);
        for (int i = 0; i < COUNT; i++) {
            const kmp_ensemble_result *r = &first.result[i];
            CHECK(r->status == KEMPE_OK && !r->alone && r->h < 1e-12 && r->hdot < 1e-12 && r->drift < 1e-6);
            parts += r->parts;
            if (r->status != KEMPE_OK || r->alone)
                printf("  %d: %s %s\n", i, r->why ? r->why : "", r->reason ? r->reason : "");
        }
        run(&x, &spec, (kmp_ensemble_execution){.alone = true}, &other);
        double off = distance(&x, &first, &other);
        printf("  %s: %ld steps, %ld by itself, %d parts %s; from runs one by one %.2g\n", motions[k].name,
               first.result[0].steps, other.result[0].steps, parts, first.result[0].why ? first.result[0].why : "",
               off);
        CHECK(off < motions[k].near && (parts > 0) == motions[k].parts);
        drop(&first);
        drop(&other);
        scatter(&x);
    }
}

/* -- closed forms -------------------------------------------------------------------------------------- */

/* A ball that falls from a height onto a spring at 0: free flight and parts of sines in turn. */
static void bounce(double k, double m, double t, double *q, double *qd)
{
    const double g = 9.81, height = 0.5;
    double w = sqrt(k / m), v = sqrt(2 * g * height), fall = v / g, sag = g / (w * w);
    double contact = 2 * (acos(-1.0) - atan(v * w / g)) / w, period = contact + 2 * fall, s = t + fall;
    s -= period * floor(s / period);
    double angle = w * (s - 2 * fall);
    *q = s <= 2 * fall ? v * s - 0.5 * g * s * s : sag * (cos(angle) - 1) - v / w * sin(angle);
    *qd = s <= 2 * fall ? v - g * s : -sag * w * sin(angle) - v * cos(angle);
}

static void balls_bounce(void)
{
    static const char *const laws[] = {BALL("if(q(S) < 0, -k*q(S), 0)"), BALL("-k*min(q(S), 0)")};
    static outcome out;
    random_seed(12);
    for (size_t law = 0; law < sizeof laws / sizeof *laws; law++) {
        const motion m = {.text = laws[law], .varied = {"k", "m", NULL}, .spread = 0.3};
        const kmp_run_spec spec = {.rtol = 1e-12, .t_end = 3};
        many x = gather_motion(&m);
        double worst = 0;
        run(&x, &spec, (kmp_ensemble_execution){0}, &out);
        for (int i = 0; i < COUNT; i++) {
            double q, qd;
            bounce(x.values[2 * i], x.values[2 * i + 1], 3, &q, &qd);
            worst = check_max(worst, fmax(fabs(out.q[i] - q), fabs(out.qd[i] - qd)));
            CHECK(!out.result[i].alone && out.result[i].parts == 0);
        }
        printf("  distance from the closed form %.2g\n", worst);
        CHECK(worst < 1e-8);
        drop(&out);
        scatter(&x);
    }
}

/* The height of a ball that falls from h, rebounds with e of its rate, and rests once rebounds have accumulated. */
static double rebound(double h, double e, double t)
{
    const double g = 9.81;
    double v = sqrt(2 * g * h), s = t - v / g;
    if (s < 0)
        return h - 0.5 * g * t * t;
    if (s >= 2 * v * e / (g * (1 - e)))
        return 0;
    for (v *= e; s > 2 * v / g; v *= e)
        s -= 2 * v / g;
    return v * s - 0.5 * g * s * s;
}

static void balls_rebound(void)
{
    static const double times[] = {0.3, 2.2, 3.6, 5};
    static outcome out;
    const motion m = {.name = "contact_bounce", .varied = {"q.z", NULL}, .spread = 0.2};
    random_seed(14);
    for (size_t k = 0; k < sizeof times / sizeof *times; k++) {
        const kmp_run_spec spec = {.rtol = 1e-12, .t_end = times[k]};
        many x = gather_motion(&m);
        double worst = 0;
        run(&x, &spec, (kmp_ensemble_execution){0}, &out);
        for (int i = 0; i < COUNT; i++) {
            worst = check_max(worst, fabs(out.q[i] - rebound(x.values[i], 0.8, times[k])));
            CHECK(!out.result[i].alone && out.result[i].parts == 0);
        }
        printf("  distance from the closed form at %.3g s %.2g\n", times[k], worst);
        CHECK(worst < 1e-9);
        drop(&out);
        scatter(&x);
    }
}

/* -- ends and mistakes --------------------------------------------------------------------------------- */

/* An end by a condition is that of a separate run: its time, its reason, its state. */
static void same_ends(const char *text, const char *name, kempe_status status, const char *words)
{
    static outcome first, other;
    const motion m = {.text = text, .varied = {name, NULL}, .spread = 0.05};
    many x = gather_motion(&m);
    const kmp_run_spec spec = {.rtol = 1e-9, .t_end = 4};
    if (!x.ensemble) {
        scatter(&x);
        return;
    }
    in_all_ways(&x, &spec, &first);
    run(&x, &spec, (kmp_ensemble_execution){.alone = true}, &other);
    for (int i = 0; i < COUNT; i++) {
        const kmp_ensemble_result *a = &first.result[i], *b = &other.result[i];
        CHECK(a->status == status && b->status == status && fabs(a->t - b->t) < 1e-7);
        CHECK(a->reason && strstr(a->reason, words));
        CHECK(a->alone == (status == KEMPE_E_FAILED) && a->parts == !a->alone);
    }
    if (first.result[0].reason)
        printf("  %s; %s\n", first.result[0].reason, first.result[0].why ? first.result[0].why : "");
    CHECK(distance(&x, &first, &other) < 1e-7);
    drop(&first);
    drop(&other);
    scatter(&x);
}

static void runs_end(void)
{
    random_seed(13);
    same_ends("kempe: 1\nparameters: {f: 2e5}\n"
              "bodies: {pin: {joint: {planar: z, coordinates: [x, y, a], at: ground}, mass: 1, inertia: {zz: 1}}}\n"
              "contacts: {pin: {journal: pin, clearance: 0.5 mm, law: johnson, young: 207 GPa, length: 1 mm}}\n"
              "forces: {push: {joint: x, force: f}}\n",
              "f", KEMPE_STOPPED, "the depth of 'pin' reaches 0.51 clearances");
    same_ends("kempe: 1\nparameters: {f: 1}\nbodies: {sledge: {joint: {name: S, prismatic: x, at: ground}, mass: 1}}\n"
              "forces: {rub: {joint: S, force: -f*sign(qd(S))}}\nstart: {qd: {S: 2}}\n",
              "f", KEMPE_E_FAILED, "changes back and forth");
}

int main(void)
{
    TEST(lanes_do_not_matter);
    TEST(balls_bounce);
    TEST(balls_rebound);
    TEST(runs_end);
    return check_report();
}
