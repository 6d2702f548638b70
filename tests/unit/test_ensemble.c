/* SPDX-License-Identifier: BSD-3-Clause */
/* wings: ensemble */
/* ctest: slow once 16 */
/* Ensembles: the same bits whatever the number of lanes and whether they are machine code; the answers of models that
 * are read with the same values, one by one; what lanes leave to runs of their own; what cannot be run. */
#include "base/context.h"
#include "base/memory.h"
#include "ensemble/lanes/ensemble_kernels.h"
#include "linalg/dense/dense.h"
#include "loaded.h"
#include "random.h"
#include "varied_models.h"
#include <kempe/kempe.h>
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

/* -- lanes do not matter ----------------------------------------------------------------------------- */

/* Starts that a run has noted serve the next one, as the check of convergence: the bits are those of starts that are
 * assembled again. */
static void noted_starts(many *x, const kmp_run_spec *spec, const outcome *first)
{
    static outcome other;
    const size_t numbers = 2 * (size_t)COUNT * (size_t)x->n;
    double *starts = malloc(numbers * sizeof *starts);
    CHECK(starts != NULL);
    for (size_t k = 0; starts && k < numbers; k++)
        starts[k] = NAN;
    for (int pass = 0; starts && pass < 2; pass++) {
        run(x, spec, (kmp_ensemble_execution){.threads = 2, .width = 4, .starts = starts}, &other);
        CHECK(differ(x, first, &other) == 0);
        drop(&other);
        for (size_t k = 0; k < numbers; k++)
            CHECK(isfinite(starts[k]));
    }
    bool moves = false;
    for (int k = 0; starts && k < x->n; k++) { /* the first instance begins at rest: these are not assembled */
        moves = moves || starts[x->n + k] != 0;
        starts[x->n + k] = 0;
    }
    run(x, spec, (kmp_ensemble_execution){.starts = starts}, &other);
    CHECK((differ(x, first, &other) > 0) == moves);
    drop(&other);
    free(starts);
}

static void one_mechanism(many x, double t_end, double near, int least_exchanges)
{
    static outcome first, other;
    static const kmp_ensemble_execution ways[] = {{.width = 1},
                                                  {.width = 1, .plain = true},
                                                  {.width = 4},
                                                  {.width = 8, .plain = true},
                                                  {.width = 3},
                                                  {.width = 4, .plain = true},
                                                  {.threads = 1},
                                                  {.threads = 1, .width = 16},
                                                  {.width = 16, .plain = true},
                                                  {.threads = 2, .width = 4},
                                                  {.threads = 3, .width = 1},
                                                  {.threads = 9, .width = 1},
                                                  {.threads = 1, .width = 2, .pools = 1},
                                                  {.threads = 2, .width = 1, .pools = 1}};
    const kmp_run_spec spec = {.rtol = 1e-9, .t_end = t_end};
    if (!x.ensemble) {
        scatter(&x);
        return;
    }
    run(&x, &spec, (kmp_ensemble_execution){.width = 8}, &first);
    CHECK(first.work.alone == 0 && first.work.lane_steps > 0);
    long exchanges = 0, rejected = 0;
    for (int i = 0; i < COUNT; i++) {
        const kmp_ensemble_result *r = &first.result[i];
        exchanges += r->exchanges;
        rejected += r->rejected;
        CHECK(r->status == KEMPE_OK && !r->reason && !r->alone && r->t == t_end && r->steps > 5);
        CHECK(r->h < 1e-12 && r->hdot < 1e-12 && r->drift < 1e-6);
    }
    CHECK(exchanges >= least_exchanges && rejected > 0);
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        run(&x, &spec, ways[k], &other);
        CHECK(differ(&x, &first, &other) == 0);
        CHECK(ways[k].pools ? other.work.pools <= first.work.pools : other.work.pools == first.work.pools);
        CHECK(other.work.threads >= 1 && (!ways[k].threads || other.work.threads <= ways[k].threads));
        drop(&other);
    }
    noted_starts(&x, &spec, &first);
    run(&x, &spec, (kmp_ensemble_execution){.alone = true}, &other);
    double off = distance(&x, &first, &other);
    printf("  %ld steps, %ld exchanges, %d choices; from runs one by one %.2g\n", first.result[0].steps, exchanges,
           first.work.pools, off);
    CHECK(other.work.alone == COUNT && off < near);
    for (int i = 0; i < COUNT; i++)
        CHECK(other.result[i].drift < 1e-6);
    for (int i = 0; i < COUNT; i++) { /* the same decisions */
        CHECK(labs(first.result[i].steps - other.result[i].steps) <= 1);
        CHECK(first.result[i].exchanges == other.result[i].exchanges);
    }
    drop(&first);
    drop(&other);
    scatter(&x);
}

/* With a spring, a damper and a motor, whose work counts. */
static const char driven[] =
    "kempe: 1\nname: driven\nparameters: {l: 0.5, m: 2, k: 40, d: 0.6, f: 3, r: 0.2, off: 0}\n"
    "ground: {points: {O: [0, off, 0], S: [r + l, 0, 0]}}\nbodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: m, com: [r/2, 0, 0], inertia: {zz: m*r^2/12},\n"
    "      points: {E: [r, -off, 0]}}\n"
    "  b: {joint: {name: b, revolute: z, at: a.E}, mass: 1, com: [l/2, 0, 0], inertia: {zz: l^2/12},\n"
    "      points: {E: [l, 0, 0]}}\n"
    "  c: {joint: {name: c, prismatic: x, at: ground.S}, mass: 3, points: {P: [0, 0, 0]}}\n"
    "loops: {E: {ball: [b.E, c.P]}}\n"
    "forces:\n  s: {joint: c, spring: {stiffness: k, damping: d}}\n  e: {joint: a, torque: f*sin(3*t) - qd(a)*d}\n"
    "start: {hold: [a], qd: {a: 9}}\n";

/* No loops: two freedoms. */
static const char tree[] =
    "kempe: 1\nname: tree\nparameters: {l: 0.5, m: 2, d: 0.1}\nground: {points: {O: [0, 0, 0]}}\n"
    "gravity: [0, -9.81, 0]\nbodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: m, com: [l, 0, 0], inertia: {zz: 0.1},\n"
    "      points: {E: [2*l, 0, 0]}}\n"
    "  b: {joint: {name: b, revolute: z, at: a.E}, mass: 1, com: [l/2, 0, 0], inertia: {zz: m*l^2/12}}\n"
    "forces: {e: {joint: b, torque: -d*qd(b)}}\n";

/* Inputs of three methods; their values jump, bend and swing. */
static const char given[] =
    "kempe: 1\nname: given\nparameters: {l: 0.5, m: 2, d: 0.1, k: 1}\nground: {points: {O: [0, 0, 0]}}\n"
    "gravity: [0, -9.81, 0]\ninputs:\n"
    "  held: {t: [0.1, 0.31, 0.313, 0.6], value: [0, 2, -1, 3], method: hold, unit: N*m}\n"
    "  bent: {t: [0.2, 0.5, 0.7], value: [0, 1, -1], method: linear, unit: N*m}\n"
    "  smooth: {t: [0, 0.2, 0.4, 0.6, 0.8], value: [0, 1, 0, -1, 0], method: cubic, unit: N*m}\nbodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: m, com: [l, 0, 0], inertia: {zz: 0.1},\n"
    "      points: {E: [2*l, 0, 0]}}\n"
    "  b: {joint: {name: b, revolute: z, at: a.E}, mass: 1, com: [l/2, 0, 0], inertia: {zz: m*l^2/12}}\n"
    "forces: {e: {joint: b, torque: held + bent - d*qd(b)}, f: {joint: a, torque: smooth + held*smooth*k}}\n";

/* A block of three rows, whose order of elimination is watched. */
static const char in_space[] =
    "kempe: 1\nname: in space\nparameters: {a: 0.2, b: 0.7, c: 0.5}\ngravity: [0, 0, -9.81]\n"
    "ground: {points: {O: [0, 0, 0], D: [0.6, 0.4, 0.1]}}\nbodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 0.1}, points: {E: [a, 0, 0]}}\n"
    "  b: {joint: {name: b, universal: [y, z], at: a.E}, mass: 1, com: [b/2, 0, 0],\n"
    "      inertia: {xx: 0.001, yy: 0.05, zz: 0.05}, points: {E: [b, 0, 0]}}\n"
    "  c: {joint: {name: c, revolute: y, at: ground.D}, mass: 1, com: [0, 0, c/2], inertia: {yy: 0.03},\n"
    "      points: {E: [0, 0, c]}}\n"
    "loops: {E: {ball: [b.E, c.E]}}\nstart: {q: {b.1: -0.5, b.2: 0.5}, hold: [a], qd: {a: 6}}\n";

/* A crank that is led, with a damper and a free arm: the work of the drive counts in the balance of energy. */
static const char led[] =
    "kempe: 1\nname: led\nparameters: {r: 0.2, l: 0.5, w: 5, d: 0.3}\ngravity: [0, -9.81, 0]\n"
    "ground: {points: {O: [0, 0, 0], S: [r + l, 0, 0]}}\nbodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: 1, com: [r/2, 0, 0], inertia: {zz: 0.01},\n"
    "      points: {E: [r, 0, 0]}}\n"
    "  b: {joint: {name: b, revolute: z, at: a.E}, mass: 1, com: [l/2, 0, 0], inertia: {zz: l^2/12},\n"
    "      points: {E: [l, 0, 0]}}\n"
    "  c: {joint: {name: c, prismatic: x, at: ground.S}, mass: 3, points: {P: [0, 0, 0]}}\n"
    "  arm: {joint: {name: arm, revolute: z, at: c.P}, mass: 1, com: [l, 0, 0], inertia: {zz: 0.1}}\n"
    "loops: {E: {ball: [b.E, c.P]}}\ndrives: {a: {joint: a, angle: \"w*t + 0.2*sin(3*t)\"}}\n"
    "forces: {e: {joint: arm, torque: -d*qd(arm)}, f: {joint: c, spring: {stiffness: 20, damping: 2}}}\n";

/* Conditions of solved equations: a kink and a comparison of implicit variables. */
static const char solved[] =
    "kempe: 1\nname: solved\nparameters: {r: 0.3, edge: 0.7, k: 300}\ngravity: [0, -9.81, 0]\n"
    "algebraic:\n"
    "  stop: {of: {d: 0, e: 0}, zero: [\"d - q(x) + edge\", \"e - max(d, 0)\"]}\n"
    "  back: {of: {f: 0, g: 0}, zero: [\"f - q(x) + 0.3\", \"g - if(f < 0, f, 0)\"]}\n"
    "bodies:\n"
    "  a: {joint: {name: a, revolute: z, at: ground}, mass: 1, com: [0.1, 0, 0], inertia: {zz: 0.1}}\n"
    "  x: {joint: {name: x, prismatic: x, at: ground}, mass: 2}\n"
    "forces: {f: {joint: x, force: \"-20*q(x) - k*e - k*g\"}}\n"
    "loops: {rod: {constraint: \"q(x) - r*cos(q(a)) - 0.5\"}}\n"
    "start: {q: {a: 0.4, x: 0.8}, qd: {a: 3}, hold: [a]}\n";

static void test_lanes_do_not_matter(void)
{
    random_seed(3);
    one_mechanism(gather("four_bar/four_bar",
                         (const char *const[]){"crank", "coupler", "rocker", "base", "crank_mass", "qd.crank", NULL},
                         0.03),
                  0.6, 1e-6, COUNT);
    one_mechanism(gather("slider_crank/slider_crank", (const char *const[]){"l", "r", "rod_mass", NULL}, 0.1), 3, 1e-6,
                  0);
    one_mechanism(gather("stephenson/stephenson", (const char *const[]){"crank", "rod", "rho", NULL}, 0.01), 1, 1e-6,
                  0);
    one_mechanism(gather("spatial_slider_crank/spatial_slider_crank", (const char *const[]){"l", "axial", NULL}, 0.02),
                  1, 1e-6, 0);
    one_mechanism(gather_text(driven, (const char *const[]){"l", "m", "k", "d", "f", "r", NULL}, 0.05), 1, 1e-6, 0);
    one_mechanism(gather_text(in_space, (const char *const[]){"a", "b", "c", NULL}, 0.02), 1, 1e-6, 0);
    one_mechanism(gather_text(tree, (const char *const[]){"q.a", "l", "m", "d", NULL}, 0.1), 1, 1e-6, 0);
    one_mechanism(gather_text(given, (const char *const[]){"l", "m", "d", NULL}, 0.1), 1, 1e-6, 0);
    one_mechanism(gather_text(led, (const char *const[]){"l", "r", "w", "d", NULL}, 0.05), 3, 1e-6, 0);
    one_mechanism(gather_text(solved, (const char *const[]){"r", "edge", "k", NULL}, 0.02), 3, 1e-6, 0);
    one_mechanism(gather("car_axis/car_axis", (const char *const[]){"m", "w", NULL}, 0.02), 0.3, 1e-6, 0);
    one_mechanism(gather("driven_slider_crank/driven_slider_crank", (const char *const[]){"l", "speed", NULL}, 0.05), 1,
                  1e-6, 0);
    one_mechanism(gather("four_bar/four_bar_spatial", (const char *const[]){"g", "qd.crank", NULL}, 0.03), 0.6, 1e-6,
                  COUNT);
    one_mechanism(gather("parallel_robot/parallel_robot", (const char *const[]){"m_rod", "m_platform", NULL}, 0.05), 2,
                  1e-6, 0);
    one_mechanism(gather("stewart/stewart", (const char *const[]){"k", "c", NULL}, 0.05), 0.2, 1e-6, 0);
}

/* Twelve and fifteen degrees of freedom: separate runs take other programs. */
static void test_large_mechanisms(void)
{
    random_seed(14);
    one_mechanism(gather("bogie/bogie", (const char *const[]){"spring", "damper", NULL}, 0.05), 0.3, 1e-6, 0);
    one_mechanism(gather("suspension/suspension", (const char *const[]){"rear_c", NULL}, 0.05), 0.2, 1e-6, 0);
}

/* -- what is done in lanes alone --------------------------------------------------------------------- */

/* The largest of each measure, wherever it stands. */
static void test_measures(void)
{
    enum { R = 3, P = 2, N = R + P, W = 16 };
    int u[] = {1, 3}, v[] = {0, 2, 4};
    double h[R * W], dv[R * W], b[R * P * W], weights[(2 * P + R) * W], scale[N * W], per_scale[N * W];
    double per_row_scale[R * W];
    const kmp_lane_group pool = {.part = {.p = P, .r = R, .m = R, .n = N, .u = u, .v = v}, .layout = {.pivots = R}};
    random_seed(9);
    for (size_t width = 1; width <= W; width++) {
        const kmp_engine e = {
            .p = P,
            .r = R,
            .m = R,
            .n = N,
            .room = {.weight = weights, .scale = scale, .per_scale = per_scale, .per_row_scale = per_row_scale}};
        kmp_lane_watched x = {.h = h, .pivot = h, .dv = dv, .b = b};
        double *weight = weights + 2 * P * width;
        double *const vectors[] = {h, dv, weight, per_row_scale, b, scale};
        const size_t sizes[] = {R, R, R, R, R * P, N};
        for (int k = 0; k < 6; k++)
            for (size_t i = 0; i < sizes[k] * width; i++)
                vectors[k][i] = k < 2 || k == 4 ? between(-1, 1) : between(0.5, 2);
        for (size_t i = 0; i < N * width; i++)
            per_scale[i] = 1 / scale[i];
        kmp_lanes_measure(width, &e, &pool, &x);
        for (size_t l = 0; l < width; l++) {
            double most_h = 0, most_dv = 0, most_b = 0, least_h = INFINITY;
            for (size_t i = 0; i < R; i++) {
                most_h = check_max(most_h, fabs(h[i * width + l]) * per_row_scale[i * width + l]);
                least_h = fmin(least_h, fabs(h[i * width + l]));
                most_dv = check_max(most_dv, fabs(dv[i * width + l]) / weight[i * width + l]);
                for (size_t c = 0; c < P; c++)
                    most_b = check_max(most_b, fabs(b[(c * R + i) * width + l]) * scale[(size_t)u[c] * width + l] *
                                                   per_scale[(size_t)v[i] * width + l]);
            }
            CHECK(x.residual[l] == most_h && x.correction[l] == most_dv && x.growth[l] == most_b &&
                  x.least[l] == least_h);
        }
    }
}

/* -- models of their own ----------------------------------------------------------------------------- */

static void compare_with_models(const char *example, const char *const *names, double spread, double t_end)
{
    static outcome out;
    char path[1024];
    many x = gather(example, names, spread);
    const kmp_run_spec spec = {.rtol = 1e-9, .t_end = t_end};
    double worst = 0;
    (void)snprintf(path, sizeof path, "%s/examples/%s.yaml", KEMPE_ROOT, example);
    run(&x, &spec, (kmp_ensemble_execution){0}, &out);
    for (int i = 0; i < COUNT; i += 3) {
        kempe_setting set[MOST];
        char text[MOST][32];
        kempe_model *model = NULL;
        kempe_system *system = NULL;
        kempe_stepper *stepper = NULL;
        kempe_run_options one = {0};
        one.rtol = 1e-9;
        one.t_end = t_end;
        for (int k = 0; k < x.columns; k++) {
            (void)snprintf(text[k], sizeof text[k], "%.17g", x.values[i * x.columns + k]);
            set[k] = (kempe_setting){names[k], text[k]};
        }
        bool made = kempe_model_read_set(x.context, path, set, x.columns, &model) == KEMPE_OK &&
                    kempe_system_new(model, &system) == KEMPE_OK &&
                    kempe_stepper_new(system, &one, &stepper) == KEMPE_OK &&
                    kempe_stepper_advance(stepper, t_end) == KEMPE_OK;
        CHECK(made && !out.result[i].alone);
        for (int k = 0; made && k < x.n; k++) {
            double q = kempe_stepper_q(stepper)[k], qd = kempe_stepper_qd(stepper)[k];
            worst = check_max(worst, fabs(out.q[i * x.n + k] - q) / fmax(1, fabs(q)));
            worst = check_max(worst, fabs(out.qd[i * x.n + k] - qd) / fmax(10, fabs(qd)));
        }
        kempe_stepper_free(stepper);
        kempe_system_free(system);
        kempe_model_free(model);
    }
    printf("  %s: %.2g\n", example, worst);
    CHECK(worst < 1e-6);
    drop(&out);
    scatter(&x);
}

static void test_models_of_their_own(void)
{
    random_seed(4);
    compare_with_models("four_bar/four_bar",
                        (const char *const[]){"crank", "coupler", "base", "coupler_mass", "rocker_mass", NULL}, 0.04,
                        0.5);
    compare_with_models("slider_crank/slider_crank", (const char *const[]){"r", "l", "slider_mass", NULL}, 0.1, 2);
    compare_with_models("stephenson/stephenson", (const char *const[]){"crank", "lever", "rho", NULL}, 0.01, 1);
    compare_with_models("spatial_slider_crank/spatial_slider_crank", (const char *const[]){"r", "l", NULL}, 0.02, 1);
}

/* -- alone ------------------------------------------------------------------------------------------- */

/* All of them by runs of their own, and as if nobody had asked for lanes. */
static void test_what_lanes_cannot(void)
{
    static const struct {
        const char *example, *name, *formulation, *integrator;
        double t_end;
        const char *why;
    } cases[] = {{"four_bar/four_bar", "crank", "projected", "dop853", 0.01, "another formulation"},
                 {"governor/governor", "K", NULL, "radau5", 0.002, "another integrator"}};
    static outcome some, all;
    random_seed(5);
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        many x = gather(cases[k].example, (const char *const[]){cases[k].name, NULL}, 0.01);
        const kmp_run_spec spec = {.formulation = cases[k].formulation,
                                   .integrator = cases[k].integrator,
                                   .rtol = 1e-6,
                                   .t_end = cases[k].t_end};
        run(&x, &spec, (kmp_ensemble_execution){0}, &some);
        run(&x, &spec, (kmp_ensemble_execution){.alone = true, .threads = 3}, &all);
        CHECK(some.work.alone == COUNT && differ(&x, &some, &all) == 0);
        for (int i = 0; i < COUNT; i++)
            CHECK(some.result[i].why && strcmp(some.result[i].why, cases[k].why) == 0);
        for (int i = 0; i < COUNT; i++)
            CHECK(some.result[i].status == KEMPE_OK && some.result[i].h < 1e-10);
        drop(&some);
        drop(&all);
        scatter(&x);
    }
}

/* -- in part ----------------------------------------------------------------------------------------- */

/* The part of all attempted steps that lanes have made. */
static double attempts_in_lanes(const outcome *out)
{
    double all = 0;
    for (int i = 0; i < COUNT; i++)
        all += (double)(out->result[i].steps + out->result[i].rejected + out->result[i].refused);
    return (double)out->work.lane_steps / all;
}

/* Separate runs lead across change points and singular angles, and back to the lanes. */
static void one_with_parts(many x, double t_end, double near, const char *why)
{
    static outcome first, other;
    static const kmp_ensemble_execution ways[] = {{.width = 1},
                                                  {.width = 16},
                                                  {.width = 8, .plain = true},
                                                  {.threads = 2, .width = 4},
                                                  {.threads = 3, .width = 1, .pools = 1}};
    const kmp_run_spec spec = {.rtol = 1e-9, .t_end = t_end};
    if (!x.ensemble) {
        scatter(&x);
        return;
    }
    run(&x, &spec, (kmp_ensemble_execution){.width = 8}, &first);
    CHECK(first.work.alone == 0 && first.work.lane_steps > 0);
    for (int i = 0; i < COUNT; i++) {
        const kmp_ensemble_result *r = &first.result[i];
        CHECK(r->status == KEMPE_OK && !r->reason && !r->alone && r->t == t_end && r->parts > 0 && r->steps > 5);
        CHECK(r->why && strcmp(r->why, why) == 0);
        CHECK(r->h < 1e-12 && r->hdot < 1e-12 && r->drift < 1e-6);
    }
    for (size_t k = 0; k < sizeof ways / sizeof *ways; k++) {
        run(&x, &spec, ways[k], &other);
        CHECK(differ(&x, &first, &other) == 0);
        drop(&other);
    }
    run(&x, &spec, (kmp_ensemble_execution){.alone = true}, &other);
    double off = distance(&x, &first, &other);
    printf("  %ld steps, %d parts; of all attempts %.0f %% in lanes; from runs one by one %.2g\n",
           first.result[0].steps, first.result[0].parts, 100 * attempts_in_lanes(&first), off);
    CHECK(other.work.alone == COUNT && off < near && attempts_in_lanes(&first) > 0.3);
    drop(&first);
    drop(&other);
    scatter(&x);
}

/* A body on a spherical joint, with an arm and springs, which turns over. */
static const char turning[] =
    "kempe: 1\ngravity: [0, 0, -9.81]\nparameters: {k: 3, m: 1, c: 0.1}\n"
    "ground: {points: {A: [1, 0.2, 1], B: [-1, 0, 1]}}\nbodies:\n"
    "  a: {joint: {name: J, spherical: x, at: ground}, mass: m, com: [0.05, 0.02, -0.2],\n"
    "      inertia: {xx: 0.1, yy: 0.12, zz: 0.05}, points: {P: [0.2, 0, 0], W: [0.1, 0, -0.3]}}\n"
    "  b: {joint: {name: W, revolute: [1, 0, 1], at: a.W}, mass: 0.5, com: [0.1, 0, 0.05],\n"
    "      inertia: {xx: 0.02, yy: 0.02, zz: 0.03}, points: {R: [0.1, 0.1, 0]}}\n"
    "forces: {f: {spring: [ground.A, a.P], stiffness: k, damping: c}, g: {spring: [ground.B, b.R], stiffness: 2}}\n"
    "start: {q: {J.2: %s}, qd: {J.1: 2, J.2: 6, J.3: 1, W: 2}}\n";

static void test_parts(void)
{
    static const char during[] = "a change point during the run",
                      singular[] = "a spherical joint near the singular position of its angles";
    static const char *const starts[] = {"0", "1.2"};
    random_seed(6);
    for (int k = 0; k < 2; k++) {
        char text[2048];
        (void)snprintf(text, sizeof text, turning, starts[k]);
        one_with_parts(gather_text(text, (const char *const[]){"k", "m", "c", NULL}, 0.02), 3, 1e-6, singular);
    }
    one_with_parts(gather("n_four_bar/n_four_bar_1", (const char *const[]){"m", NULL}, 0.01), 2, 1e-6, during);
    one_with_parts(gather("n_four_bar/n_four_bar", (const char *const[]){"m", NULL}, 0.01), 2, 1e-6, during);
    one_with_parts(gather("n_four_bar/n_four_bar_40", (const char *const[]){"m", NULL}, 0.01), 1, 1e-6, during);
}

/* -- what cannot be run ------------------------------------------------------------------------------ */

static void test_bad_instances(void)
{
    static outcome out, other;
    many x = gather("four_bar/four_bar", (const char *const[]){"coupler", "coupler_mass", NULL}, 0.02);
    const kmp_run_spec spec = {.rtol = 1e-8, .t_end = 0.3};
    run(&x, &spec, (kmp_ensemble_execution){0}, &other);
    x.values[2 * 3] = 0.1;    /* the square root of a negative number */
    x.values[2 * 5 + 1] = -1; /* a mass */
    run(&x, &spec, (kmp_ensemble_execution){0}, &out);
    CHECK(out.result[3].status == KEMPE_E_INPUT && isnan(out.q[3 * x.n]));
    CHECK_TEXT(out.result[3].reason, "parameter 'across' is not a number: a finite number is expected");
    CHECK(out.result[5].status == KEMPE_E_INPUT);
    CHECK_TEXT(out.result[5].reason, "the mass of body 'coupler' is negative: -1");
    for (int i = 0; i < COUNT; i++)
        if (i != 3 && i != 5) /* the others do not know */
            CHECK(same_result(&out.result[i], &other.result[i]) &&
                  memcmp(out.q + i * x.n, other.q + i * x.n, (size_t)x.n * sizeof(double)) == 0);
    drop(&out);
    drop(&other);
    scatter(&x);
}

/* A motion that grows without end is found in its lane, and told as by a run. */
static void test_runaways(void)
{
    static const char text[] = "kempe: 1\ngravity: [0, 0, 0]\nparameters: {c: 40}\nbodies:\n"
                               "  cart: {joint: {name: x, prismatic: x, at: ground}, mass: 1}\n"
                               "forces: {f: {joint: x, force: 'c*c*q(x)'}}\nstart: {q: {x: 0.1}, qd: {x: 4}}\n";
    static outcome out;
    many x = gather_text(text, (const char *const[]){"c", NULL}, 0.02);
    run(&x, &(kmp_run_spec){.rtol = 1e-8, .t_end = 20, .max_step = 1e-4}, (kmp_ensemble_execution){0}, &out);
    for (int i = 0; i < COUNT; i++) {
        CHECK(out.result[i].status == KEMPE_E_FAILED && out.result[i].alone);
        CHECK_TEXT(out.result[i].why, "too much work");
        CHECK(out.result[i].reason && strstr(out.result[i].reason, "the motion grows without end: at t = 2"));
    }
    CHECK(out.work.lane_steps >= 20000);
    drop(&out);
    scatter(&x);
}

/* Loops that cannot be closed are told as an assembly tells them. */
static void test_open_loops(void)
{
    static const char text[] =
        "kempe: 1\nname: bars\nparameters: {a: 0.3, b: 0.8, c: 0.7, d: 0.9}\n"
        "ground: {points: {O: [0, 0, 0], D: [d, 0, 0]}}\nbodies:\n"
        "  a: {joint: {name: a, revolute: z, at: ground.O}, mass: 1, inertia: {zz: 1}, points: {E: [a, 0, 0]}}\n"
        "  b: {joint: {name: b, revolute: z, at: a.E}, mass: 1, inertia: {zz: 1}, points: {E: [b, 0, 0]}}\n"
        "  c: {joint: {name: c, revolute: z, at: ground.D}, mass: 1, inertia: {zz: 1}, points: {E: [c, 0, 0]}}\n"
        "loops: {E: {ball: [b.E, c.E]}}\n"
        "start: {q: {a: 1.5, b: -1, c: 1.6}, hold: [a], qd: {a: 3}}\n";
    static outcome out;
    many x = gather_text(text, (const char *const[]){"d", NULL}, 0.02);
    const kmp_run_spec spec = {.rtol = 1e-8, .t_end = 0.1};
    x.values[7] = 5;
    run(&x, &spec, (kmp_ensemble_execution){0}, &out);
    CHECK(out.result[7].status == KEMPE_E_FAILED && out.result[7].alone && out.work.alone == 1);
    CHECK(out.result[7].reason && strstr(out.result[7].reason, "loop 'E' cannot be closed while holding a"));
    CHECK(out.result[8].status == KEMPE_OK && !out.result[8].alone);
    drop(&out);
    scatter(&x);
}

static void test_interrupt(void)
{
    static outcome out;
    many x = gather("four_bar/four_bar", (const char *const[]){"coupler", NULL}, 0.02);
    const kmp_run_spec spec = {.rtol = 1e-8, .t_end = 0.3};
    kempe_context_interrupt(x.context);
    run(&x, &spec, (kmp_ensemble_execution){0}, &out);
    for (int i = 0; i < COUNT; i++)
        CHECK(out.result[i].status == KEMPE_STOPPED && strcmp(out.result[i].reason, "interrupted") == 0);
    drop(&out);
    scatter(&x);
}

static void interrupt_at(void *user, const kempe_progress *progress)
{
    if (progress->done >= 5)
        kempe_context_interrupt(user);
}

/* Instances that are done before an interrupt have their results; an engine is as good as new after it. */
static void test_interrupt_between(void)
{
    static outcome first, out;
    many x = gather("four_bar/four_bar", (const char *const[]){"coupler", NULL}, 0.02);
    const kmp_run_spec spec = {.rtol = 1e-8, .t_end = 0.3};
    for (int threads = 1; threads <= 3; threads++) {
        const kmp_ensemble_execution execution = {.threads = threads, .width = 1};
        int ok = 0;
        run(&x, &spec, execution, &first);
        kempe_context_set_progress(x.context, 0, interrupt_at, x.context);
        run(&x, &spec, execution, &out);
        kempe_context_set_progress(x.context, 0, NULL, NULL);
        for (int i = 0; i < COUNT; i++)
            if (out.result[i].status == KEMPE_OK) {
                ok++;
                CHECK(same_result(&out.result[i], &first.result[i]) &&
                      memcmp(out.q + i * x.n, first.q + i * x.n, (size_t)x.n * sizeof(double)) == 0);
            } else {
                CHECK(out.result[i].status == KEMPE_STOPPED && isnan(out.q[i * x.n]));
            }
        CHECK(ok >= 1 && (threads > 1 || ok < COUNT));
        drop(&out);
        kmp_context_begin(x.context);
        run(&x, &spec, execution, &out);
        CHECK(differ(&x, &first, &out) == 0);
        drop(&out);
        drop(&first);
    }
    scatter(&x);
}

/* Every allocation fails once, more or less: nothing leaks, and what does not fail is the same as ever. */
static void without_memory(const char *example, const char *name, double t_end, int threads)
{
    static outcome out, first;
    many x = gather(example, (const char *const[]){name, NULL}, 0.02);
    const kmp_run_spec spec = {.rtol = 1e-6, .t_end = t_end};
    const kmp_ensemble_execution execution = {.threads = threads, .width = 2, .plain = true};
    run(&x, &spec, execution, &first);
    int failed = 0;
    kempe_status status = KEMPE_E_MEMORY;
    for (unsigned long n = 1; status == KEMPE_E_MEMORY && n < 100000; n += 1 + n / 6) {
        out = (outcome){0};
        kmp_memory_fail_at(n);
        status = kmp_ensemble_run(x.ensemble, &spec, &execution, COUNT, x.values, out.result, out.q, out.qd);
        kmp_memory_fail_at(0);
        failed += status == KEMPE_E_MEMORY;
        if (status == KEMPE_OK)
            drop(&out);
        else
            CHECK(strstr(kempe_context_message(x.context), "memory") != NULL);
    }
    CHECK(failed > (threads == 1 ? 10 : 0)); /* the allocations of other threads do not fail */
    run(&x, &spec, execution, &out);
    CHECK(differ(&x, &first, &out) == 0);
    drop(&first);
    drop(&out);
    scatter(&x);
}

static void test_no_memory(void)
{
    without_memory("four_bar/four_bar", "coupler", 0.1, 1);
    without_memory("four_bar/four_bar", "coupler", 0.1, 3);
    without_memory("n_four_bar/n_four_bar_1", "m", 2, 1);          /* parts in separate runs */
    without_memory("loose_slider/loose_slider", "speed", 2e-3, 1); /* conditions */
}

int main(void)
{
    TEST(test_lanes_do_not_matter);
    TEST(test_large_mechanisms);
    TEST(test_measures);
    TEST(test_models_of_their_own);
    TEST(test_what_lanes_cannot);
    TEST(test_parts);
    TEST(test_bad_instances);
    TEST(test_runaways);
    TEST(test_open_loops);
    TEST(test_interrupt);
    TEST(test_interrupt_between);
    TEST(test_no_memory);
    return check_report();
}
