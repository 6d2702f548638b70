/* SPDX-License-Identifier: BSD-3-Clause */
/* Parts of the report pages: poses against the symbolic positions, runs watched, numbers in few characters, and the
 * page with libraries that would break it. tests/report_pages.py opens the page in a browser. */
#include "base/base64.h"
#include "base/file.h"
#include "base/memory.h"
#include "dynamics/kinematics/kinematics_vectors.h"
#include "dynamics/kinematics/link_tree.h"
#include "integrators/run/methods.h"
#include "loaded.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include "model/data/variant.h"
#include "output/plot.h"
#include "picture/drawing.h"
#include "picture/motion_picture.h"
#include "random.h"
#include "report/comparison_page.h"
#include "symbolic/interpreter.h"
#include <glob.h>
#include <kempe/compare.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

/* -- poses ------------------------------------------------------------------------------------------------- */

/* Positions of all points as a program; the caller frees it. */
static kmp_program *positions(const kempe_model *model)
{
    kmp_graph *g = kmp_graph_new();
    kmp_tree tree;
    int count = 3 * model->point_count;
    kmp_ref *x = KMP_NEW(kmp_ref, count);
    const kmp_ref *group = x;
    kmp_program *program = NULL;
    if (g && x && kmp_tree_init(&tree, g, model, KMP_KEEP_NOTHING, false)) {
        for (int p = 0; p < model->point_count; p++) {
            kmp_vec v = kmp_point_position(&tree, p, 0);
            memcpy(x + 3 * (size_t)p, v.x, sizeof v.x);
        }
        program = kmp_program_new(g, 1, &count, &group);
        kmp_tree_free(&tree);
    }
    kmp_free(x);
    kmp_graph_free(g);
    return program;
}

static void compare_points(const kempe_model *model, const kmp_pose *poses, const double *q, const double *wanted)
{
    for (int p = 0; p < model->point_count; p++) {
        kmp_pose pose;
        kmp_pose_of_point(model, poses, q, p, &pose);
        for (int k = 0; k < 3; k++)
            CHECK_NEAR(pose.p[k], wanted[3 * p + k], 1e-13 * (1 + model->motion_count));
    }
}

static int compare_model(const char *path)
{
    kempe_context *context = kempe_context_new();
    kempe_model *model = NULL;
    int compared = 0;
    if (kempe_model_read(context, path, &model) == KEMPE_OK && model->point_count > 0) {
        kmp_program *program = positions(model);
        kmp_interpreter *run = kmp_interpreter_new(program);
        kmp_pose *poses = KMP_NEW(kmp_pose, model->body_count);
        double *q = KMP_NEW(double, model->motion_count);
        for (int trial = 0; trial < 3; trial++) {
            for (int k = 0; k < model->motion_count; k++)
                q[k] = (model->motions[k].elastic ? 0.01 : 1) * between(-2, 2);
            kmp_interpreter_set(run, KMP_IN_Q, q);
            (void)kmp_interpreter_run(run, 0);
            kmp_pose_all(model, q, poses);
            compare_points(model, poses, q, kmp_interpreter_run(run, 1));
        }
        compared = model->point_count;
        kmp_free(q);
        kmp_free(poses);
        kmp_interpreter_free(run);
        kmp_program_free(program);
    }
    kempe_model_free(model);
    kempe_context_free(context);
    return compared;
}

static void poses_are_the_positions(void)
{
    static const char *const patterns[] = {"examples/*/*.yaml", "tests/models/*.yaml"};
    int compared = 0;
    random_seed(1);
    for (size_t k = 0; k < sizeof patterns / sizeof *patterns; k++) {
        char pattern[512];
        glob_t found;
        snprintf(pattern, sizeof pattern, "%s/%s", KEMPE_ROOT, patterns[k]);
        if (glob(pattern, 0, NULL, &found) != 0)
            continue;
        for (size_t i = 0; i < found.gl_pathc; i++)
            compared += compare_model(found.gl_pathv[i]);
        globfree(&found);
    }
    printf("  %d points compared\n", compared);
    CHECK(compared > 500);
}

/* All that stands between a joint and its points: axes of points on both sides, a frame, a joint gone through from its
 * other end, a screw, a weld. */
static void poses_of_turned_joints(void)
{
    static const char text[] =
        "kempe: 1\n"
        "ground: {points: {G: {at: [1, 2, 3], axes: {x: [0, 1, 0], y: [-1, 0, 0]}}}}\n"
        "bodies:\n"
        "  a:\n"
        "    mass: 1\n"
        "    inertia: {xx: 1, yy: 1, zz: 1}\n"
        "    joint: {name: A, spherical: z, at: ground.G, to: P, frame: {x: [0, 0, 1], y: [0.6, 0.8, 0]}}\n"
        "    points: {P: {at: [0.1, 0.2, 0.3], axes: {x: [0, 0, 1], y: [1, 0, 0]}}, Q: [1, 0.5, -0.25]}\n"
        "  b:\n"
        "    mass: 1\n"
        "    inertia: {xx: 1, yy: 1, zz: 1}\n"
        "    joint: {name: B, reversed: yes, cylindrical: [1, 2, 2], at: a.Q, frame: {x: [0, 0, 1], y: [1, 0, 0]}}\n"
        "    points: {R: [0.3, -0.7, 0.2]}\n";
    char path[] = "/tmp/kempe_poses_XXXXXX";
    int file = mkstemp(path);
    CHECK(file >= 0 && write(file, text, sizeof text - 1) == (ssize_t)(sizeof text - 1));
    CHECK(compare_model(path) == 4);
    close(file);
    unlink(path);
}

static void quaternions_are_the_rotations(void)
{
    kmp_pose pose = {0};
    double before[4];
    random_seed(3);
    for (int trial = 0; trial < 200; trial++) {
        double q[4], length = 0, out[4];
        for (int k = 0; k < 4; k++) {
            q[k] = trial < 4 ? k == trial : between(-1, 1);
            length += q[k] * q[k];
        }
        for (int k = 0; k < 4; k++)
            q[k] /= sqrt(length);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                int k = 3 - i - j;
                double skew = i == j ? 0 : (j - i + 3) % 3 == 1 ? -q[k] : q[k];
                pose.r[i][j] = (i == j) * (2 * q[3] * q[3] - 1) + 2 * q[i] * q[j] + 2 * q[3] * skew;
            }
        kmp_pose_quaternion(&pose, q, out);
        for (int k = 0; k < 4; k++)
            CHECK_NEAR(out[k], q[k], 1e-14);
        kmp_pose_quaternion(&pose, NULL, before);
        CHECK(before[3] >= 0);
    }
}

/* -- pins -------------------------------------------------------------------------------------------------- */

static void turned(const kmp_pose *pose, const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = pose->r[i][0] * v[0] + pose->r[i][1] * v[1] + pose->r[i][2] * v[2];
}

/* The pin of a hinge keeps its direction in space when the hinge alone turns. */
static int check_pins(const kempe_model *model, const kmp_drawing *drawing)
{
    int count = 0, n = model->motion_count;
    double *q = KMP_NEW(double, n);
    kmp_pose *before = KMP_NEW(kmp_pose, model->body_count), *after = KMP_NEW(kmp_pose, model->body_count);
    for (int k = 0; k < n; k++)
        q[k] = 0.3 + 0.7 * k - 0.1 * k * k;
    kmp_pose_all(model, q, before);
    for (int k = 0; k < drawing->mark_count; k++) {
        const kmp_mark *m = &drawing->marks[k];
        double a[3], b[3];
        if (!(m->marks & KMP_MARK_HINGE) || !(m->marks & KMP_MARK_JOINT))
            continue;
        int motion = model->bodies[m->body].first_motion;
        q[motion] += 1.1;
        kmp_pose_all(model, q, after);
        q[motion] -= 1.1;
        turned(&before[m->body], m->axis, a);
        turned(&after[m->body], m->axis, b);
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(a[i], b[i], 1e-12);
        CHECK_NEAR(a[0] * a[0] + a[1] * a[1] + a[2] * a[2], 1, 1e-12);
        count++;
    }
    kmp_free(q);
    kmp_free(before);
    kmp_free(after);
    return count;
}

static void pins_are_axes_of_hinges(void)
{
    static const char *const files[] = {"examples/bennett/bennett.yaml", "examples/bricard/bricard.yaml",
                                        "examples/double_wishbone/double_wishbone.yaml",
                                        "examples/suspension/suspension.yaml", "tests/models/robotran.yaml"};
    int count = 0;
    for (size_t k = 0; k < sizeof files / sizeof *files; k++) {
        loaded l = load(files[k]);
        kmp_drawing drawing;
        bool ok = l.model && kmp_drawing_init(&drawing, l.model, l.model->body_count);
        CHECK(ok);
        count += ok ? check_pins(l.model, &drawing) : 0;
        if (ok)
            kmp_drawing_free(&drawing);
        unload(&l);
    }
    CHECK(count > 15);
}

/* The pins of both sides of a hinge that closes a loop are along one line at a closed position. */
static void pins_of_cut_hinges(void)
{
    loaded l = load("tests/models/bennett_hinge.yaml");
    kempe_trajectory *t = NULL;
    kmp_drawing drawing;
    double axis[2][3];
    int found = 0;
    CHECK(l.system && kempe_simulate(l.system, NULL, &t) == KEMPE_OK);
    kmp_pose *poses = KMP_NEW(kmp_pose, l.model->body_count);
    kmp_pose_all(l.model, kempe_trajectory_q(t, 0), poses);
    CHECK(kmp_drawing_init(&drawing, l.model, l.model->body_count));
    for (int k = 0; k < drawing.mark_count; k++)
        if (drawing.marks[k].marks & KMP_MARK_CLOSURE && drawing.marks[k].marks & KMP_MARK_HINGE && found < 2)
            turned(&poses[drawing.marks[k].body], drawing.marks[k].axis, axis[found++]);
    CHECK(found == 2);
    for (int i = 0; i < 3 && found == 2; i++)
        CHECK_NEAR(axis[0][i], axis[1][i], 1e-10);
    kmp_drawing_free(&drawing);
    kmp_free(poses);
    kempe_trajectory_free(t);
    unload(&l);
}

/* -- numbers ----------------------------------------------------------------------------------------------- */

static void numbers_in_few_characters(void)
{
    const double x[] = {1.0 / 3, -1234567.89, 0, -0.0, 6e-310, NAN, 1e300};
    const int16_t shorts[] = {1, -2, 258, 32767};
    kmp_text text = {0};
    kmp_json json = kmp_json_begin_as(&text, KMP_JSON_COMPACT);
    kmp_json_array(&json, NULL);
    kmp_json_rounded_numbers(&json, NULL, 7, x, 4);
    kmp_json_shorts(&json, NULL, 4, shorts);
    kmp_json_shorts(&json, NULL, 2, shorts);
    kmp_json_shorts(&json, NULL, 0, shorts);
    kmp_json_floats(&json, NULL, 2, (double[]){1, -2});
    kmp_json_string(&json, NULL, "a</script>\"\n");
    kmp_json_end(&json);
    CHECK_TEXT(text.s, "[[0.3333,-1.235e+06,0,0,6e-310,null,1e+300],"
                       "\"AQD+/wIB/38=\",\"AQD+/w==\",\"\",\"AACAPwAAAMA=\",\"a\\u003c/script>\\\"\\u000a\"]");
    kmp_text_free(&text);
}

/* -- runs watched ------------------------------------------------------------------------------------------ */

static kempe_comparison *compare(const kempe_system *system, const char *rtols, double t_end)
{
    kempe_compare_options run = {0};
    kempe_comparison *comparison = NULL;
    run.rtols = rtols;
    run.t_end = t_end;
    CHECK(kempe_comparison_new(system, &run, &comparison) == KEMPE_OK);
    return comparison;
}

static int find_run(const kempe_comparison *c, const char *formulation, double rtol)
{
    for (int k = 0; k < c->count; k++)
        if (strcmp(c->runs[k].method->formulation, formulation) == 0 && fabs(c->runs[k].rtol - rtol) < 0.1 * rtol)
            return k;
    return -1;
}

/* The ranges against each step of the run itself. */
static void check_ranges(const kempe_comparison *c, const kmp_record *r, double t_end)
{
    const kmp_compared *run = &c->runs[r->run];
    kmp_run_spec spec = {.formulation = run->method->formulation,
                         .form = run->method->form,
                         .integrator = run->method->integrator,
                         .rtol = run->rtol,
                         .atol = run->rtol,
                         .t_end = t_end};
    kmp_runner *runner = NULL;
    CHECK(kmp_run_resolve(c->system, &spec) == KEMPE_OK && kmp_runner_new(c->system, &spec, NULL, &runner) == KEMPE_OK);
    for (int k = 0; k < r->range_count; k++) {
        double least = INFINITY, most = 0, begin = kmp_runner_t(runner);
        for (long i = 0; i < r->each && kmp_runner_t(runner) < t_end; i++) {
            double t = kmp_runner_t(runner);
            CHECK(kmp_runner_step(runner) == KEMPE_OK);
            least = fmin(least, kmp_runner_t(runner) - t);
            most = check_max(most, kmp_runner_t(runner) - t);
        }
        CHECK_NEAR(r->ranges[k].t, begin, 0);
        CHECK_NEAR(r->ranges[k].least, least, 0);
        CHECK_NEAR(r->ranges[k].most, most, 0);
    }
    CHECK(kmp_runner_t(runner) >= t_end);
    kmp_runner_free(runner);
}

static void check_record(const kempe_comparison *c, int run, double t_end)
{
    const kmp_compared *compared = &c->runs[run];
    kmp_record r;
    CHECK(kmp_record_make(c, run, t_end, &r) == KEMPE_OK);
    CHECK(r.run == run && r.row.rows == KMP_RECORD_ROWS + 1);
    CHECK_NEAR(kmp_samples_time(&r.row, KMP_RECORD_ROWS), t_end, 0);
    long steps = compared->report.steps;
    CHECK(r.range_count <= KMP_RECORD_RANGES && r.each * (r.range_count - 1) < steps &&
          steps <= r.each * r.range_count);
    CHECK(r.each > 1 || r.range_count == steps);
    check_ranges(c, &r, t_end);
    double drift = 0, h = 0;
    for (int k = 0; k < r.row.rows; k++) {
        drift = check_max(drift, fabs(r.energy[k]));
        h = check_max(h, r.h[k]);
    }
    CHECK(drift < 100 * compared->verdict.drift_rel + 1e-12 && drift > 0.1 * compared->verdict.drift_rel);
    CHECK(h < 100 * compared->verdict.h_max + 1e-13);
    kmp_record_free(&r);
}

static void runs_are_watched(void)
{
    loaded l = load("examples/andrews/andrews.yaml");
    kempe_comparison *c = compare(l.system, "1e-5,1e-10", 0.03);
    int shown[8], coarse = find_run(c, "reduced", 1e-5), fine = find_run(c, "dae", 1e-10);
    CHECK(c->runs[fine].report.steps > KMP_RECORD_RANGES && c->runs[coarse].report.steps < KMP_RECORD_RANGES);
    check_record(c, coarse, 0.03);
    check_record(c, fine, 0.03);
    int count = kmp_page_choose(c, shown);
    CHECK(count == 3 && shown[0] == c->advice.run);
    for (int k = 0; k < count; k++)
        for (int i = 0; i < k; i++)
            CHECK(strcmp(c->runs[shown[k]].method->formulation, c->runs[shown[i]].method->formulation) != 0);
    kempe_comparison_free(c);
    unload(&l);
}

/* The time for which a fast rotor is shown: to the end if nothing on it is off its axis. */
static double shown_of(const char *points, const char *com)
{
    char text[512];
    (void)snprintf(text, sizeof text,
                   "kempe: 1\nbodies:\n  cart: {joint: {prismatic: x, at: ground}, mass: 1}\n"
                   "  rotor: {joint: {revolute: y, at: cart}, mass: 1, com: [%s], inertia: {yy: 1}, points: {%s}}\n"
                   "start: {qd: {rotor: %d}}\n",
                   com, points, KMP_RECORD_ROWS * 2 / 3);
    loaded l = load_text(text);
    kempe_comparison *c = compare(l.system, "1e-5", 1);
    kmp_record r;
    CHECK(kmp_record_make(c, 0, 1, &r) == KEMPE_OK);
    double end = kmp_motion_picture_end(l.model, &r.row);
    kmp_record_free(&r);
    kempe_comparison_free(c);
    unload(&l);
    return end;
}

static void a_spin_is_shown_whole(void)
{
    CHECK_NEAR(shown_of("A: [0, 0.5, 0], B: [0, -1, 0]", "0, 0.1, 0"), 1, 0);
    CHECK_NEAR(shown_of("A: [0, 0.5, 0], B: [0.1, 0, 0]", "0, 0.1, 0"), 0.35 * 1.5, 1e-9); /* 2/3 rad a row */
    CHECK_NEAR(shown_of("A: [0, 0.5, 0], B: [0, -1, 0]", "0.01, 0, 0"), 0.35 * 1.5, 1e-3);
}

static void happenings_are_kept(void)
{
    loaded l = load("tests/models/parallelogram.yaml");
    kempe_comparison *c = compare(l.system, "1e-6", 2);
    kmp_record r;
    CHECK(kmp_record_make(c, 0, 2, &r) == KEMPE_OK);
    CHECK(r.log.kept > 0);
    for (int k = 0; k < r.log.kept; k++)
        CHECK(r.log.entries[k].t >= 0 && r.log.entries[k].t <= 2 && *r.log.entries[k].text);
    kmp_record_free(&r);
    kempe_comparison_free(c);
    unload(&l);
}

/* Parts that share nothing have separate steps: the record has rows and events, and no steps. */
static void parts_have_rows(void)
{
    static const char parts[] =
        "kempe: 1\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\nbodies:\n"
        "  a: {joint: {name: x, revolute: z, at: ground}, mass: 1, com: [1, 0, 0], inertia: {zz: 0.1}}\n"
        "  b: {joint: {name: y, prismatic: y, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
        "contacts: {floor: {point: b.P, on: {plane: ground.O, normal: y}, restitution: 0.8}}\n"
        "start: {q: {y: 0.5}}\n";
    loaded l = load_text(parts);
    kempe_comparison *c = compare(l.system, "1e-8", 1);
    kmp_record r;
    CHECK(kmp_record_make(c, 0, 1, &r) == KEMPE_OK);
    CHECK(r.range_count == 0 && r.row.rows == KMP_RECORD_ROWS + 1 && r.log.kept > 0);
    for (int k = 0; k < r.row.rows; k++)
        CHECK_NEAR(kmp_samples_time(&r.row, k), (double)k / KMP_RECORD_ROWS, 1e-15);
    const int falls = KMP_RECORD_ROWS / 4; /* until 0.25 s */
    CHECK_NEAR(kmp_samples_get(&r.row, KMP_QUANTITY_Q, falls)[1], 0.5 - 9.81 / 32, 1e-7);
    CHECK(fabs(r.energy[falls]) < 1e-7);
    kmp_record_free(&r);
    kempe_comparison_free(c);
    unload(&l);
}

/* -- what is drawn ----------------------------------------------------------------------------------------- */

static void drawing_of_a_slider(void)
{
    loaded l = load("examples/spatial_slider_crank/spatial_slider_crank.yaml");
    kmp_drawing d;
    CHECK(kmp_drawing_init(&d, l.model, 1000));
    CHECK(d.body_count == l.model->body_count && d.slide_count == 1);
    bool slides = false;
    for (int k = 0; k < d.mark_count; k++)
        slides = slides || (d.marks[k].marks & KMP_MARK_SLIDE);
    CHECK(slides);
    kmp_drawing_free(&d);
    CHECK(kmp_drawing_init(&d, l.model, 2)); /* the ground and one body */
    for (int k = 0; k < d.mark_count; k++)
        CHECK(d.marks[k].body < 2);
    kmp_drawing_free(&d);
    unload(&l);
}

/* -- flexible bodies --------------------------------------------------------------------------------------- */

#define RECTANGLE "young: 70 GPa, poisson: 0.3, density: 2700, section: {rectangle: [20 mm, 30 mm]}"

/* An open chain in space. */
static const char open_chain[] =
    "kempe: 1\nparameters: {L: 600 mm}\nbodies:\n"
    "  arm:\n    joint: {name: M, revolute: z, at: ground}\n"
    "    flexible: {beam: {length: L, " RECTANGLE "}, shapes: {y: 2, z: 2, torsion: 1}}\n"
    "    points: {end: {station: L}, mid: {station: L/2}, top: {station: L, offset: [0, 50 mm, 80 mm]}}\n"
    "  rod:\n    joint: {name: E, revolute: y, at: arm.top}\n"
    "    flexible: {beam: {length: 500 mm, " RECTANGLE "}, shapes: {y: 2, z: 1}, frame: chord}\n"
    "    points: {end: {station: 500 mm}, mid: {station: 250 mm}}\n"
    "  load: {joint: {name: L1, revolute: x, at: rod.end}, mass: 1, com: [0, 0, -0.1], inertia: {xx: 0.01}}\n";

/* A loop with an arm that is clamped, and a rod between pins. */
static const char closed_loop[] =
    "kempe: 1\nground: {points: {B: [500 mm, 0, 0]}}\nbodies:\n"
    "  arm:\n    joint: {name: M, revolute: z, at: ground}\n"
    "    flexible: {beam: {length: 300 mm, " RECTANGLE "}, shapes: {y: 2}}\n"
    "    points: {end: {station: 300 mm}, mid: {station: 150 mm}}\n"
    "  rod:\n    joint: {name: E, revolute: z, at: arm.end}\n"
    "    flexible: {beam: {length: 400 mm, " RECTANGLE "}, shapes: {y: 1}, frame: chord}\n"
    "    points: {end: {station: 400 mm}, mid: {station: 200 mm}}\n"
    "  crank: {joint: {name: C, revolute: z, at: ground.B}, mass: 1, inertia: {zz: 0.01}, points: {P: [0, 200 mm, "
    "0]}}\n"
    "loops: {pin: {revolute: [rod.end, crank.P]}}\nstart: {q: {M: 80 deg, E: -70 deg}}\n";

static int point_named(const kempe_model *model, int body, const char *name)
{
    int found = -1;
    for (int p = 0; p < model->point_count; p++)
        if (model->points[p].body == body && strcmp(model->points[p].name, name) == 0)
            found = p;
    CHECK(found >= 0);
    return found;
}

/* Place k of 17 of a body's curve, among the poses. */
static int curve_place(const kmp_drawing *drawing, int body, int k)
{
    int first = 0;
    while (drawing->lines[first].of != body)
        first++;
    return k == 0 ? drawing->lines[first].body[0] : drawing->lines[first + k - 1].body[1];
}

typedef struct drawn {
    kmp_drawing drawing;
    kmp_pose *poses;
    double *shift, *turn;
} drawn;

static void draw(const kempe_model *model, const double *q, drawn *d)
{
    CHECK(kmp_drawing_init(&d->drawing, model, model->body_count));
    d->poses = KMP_NEW(kmp_pose, model->body_count + d->drawing.place_count);
    d->shift = KMP_NEW(double, 3 * d->drawing.place_count);
    d->turn = KMP_NEW(double, 3 * d->drawing.place_count);
    kmp_drawing_poses(&d->drawing, model, q, d->poses);
    kmp_drawing_deformation(&d->drawing, model, q, d->poses, d->shift, d->turn);
}

static void wipe(drawn *d)
{
    kmp_drawing_free(&d->drawing);
    kmp_free(d->poses);
    kmp_free(d->shift);
    kmp_free(d->turn);
}

/* Joint angles of some tenths, deflections of some centimetres. */
static void bend(const kempe_model *model, double *q)
{
    random_seed(7);
    for (int k = 0; k < model->motion_count; k++)
        q[k] = (model->motions[k].elastic ? 0.03 : 0.6) * between(0.5, 1.5);
}

/* Points are drawn where the equations have them, and so are the middles and ends of curves. */
static void check_places(const kempe_model *model)
{
    double q[16] = {0};
    drawn d;
    bend(model, q);
    draw(model, q, &d);
    kmp_program *program = positions(model);
    kmp_interpreter *run = kmp_interpreter_new(program);
    kmp_interpreter_set(run, KMP_IN_Q, q);
    (void)kmp_interpreter_run(run, 0);
    const double *wanted = kmp_interpreter_run(run, 1);
    for (int b = 1; b < 3; b++)
        for (int k = 8; k <= 16; k += 8) {
            const int point = point_named(model, b, k == 8 ? "mid" : "end"), place = curve_place(&d.drawing, b, k);
            const kmp_drawn_point at = kmp_drawing_point(&d.drawing, model, point);
            CHECK(at.body >= d.drawing.body_count && at.body != place);
            for (int i = 0; i < 3; i++) {
                CHECK_NEAR(d.poses[at.body].p[i], wanted[3 * point + i], 1e-14);
                CHECK_NEAR(d.poses[place].p[i], wanted[3 * point + i], 1e-14);
            }
        }
    kmp_interpreter_free(run);
    kmp_program_free(program);
    wipe(&d);
}

static void curves_are_where_points_are(void)
{
    const char *const name = "L";
    const double longer = 0.85;
    loaded l = load_text(open_chain), loop = load_text(closed_loop);
    kempe_model *other = NULL;
    check_places(l.model);
    check_places(loop.model);
    CHECK(kmp_variant_instance(l.model, 1, &name, &longer, &other) == KEMPE_OK);
    check_places(other);
    kempe_model_free(other);
    unload(&l);
    unload(&loop);
}

/* The displacement of a place of a curve from x of the body's axis, in the axes of the ground. */
static void displacement(const drawn *d, int body, int k, double x, double out[3])
{
    const kmp_pose *pose = &d->poses[body], *place = &d->poses[curve_place(&d->drawing, body, k)];
    for (int i = 0; i < 3; i++)
        out[i] = place->p[i] - pose->p[i] - pose->r[i][0] * x;
}

static const double *shift_of(const drawn *d, int body, int k)
{
    return d->shift + 3 * (ptrdiff_t)(curve_place(&d->drawing, body, k) - d->drawing.body_count);
}

/* Without loops all of the displacement is deformation, and bodies ride on it. */
static void chains_deform_as_a_whole(void)
{
    loaded l = load_text(open_chain);
    double q[16] = {0}, u[3];
    drawn d;
    bend(l.model, q);
    draw(l.model, q, &d);
    for (int k = 0; k <= 16; k++) {
        displacement(&d, 1, k, 0.6 * k / 16, u);
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(shift_of(&d, 1, k)[i], u[i], 1e-14);
    }
    CHECK(fabs(u[0]) + fabs(u[1]) + fabs(u[2]) > 0.02);
    CHECK(d.drawing.rider_count == 2 && d.drawing.riders[0].body == 2 && d.drawing.riders[1].body == 3);
    for (int k = 0; k < d.drawing.place_count; k++)
        CHECK(!d.drawing.places[k].held);
    wipe(&d);
    unload(&l);
}

/* In loops the deformation is that between the places that are held, where it is none. */
static void loops_hold_places(void)
{
    const double length[] = {0, 0.3, 0.4};
    loaded l = load_text(closed_loop);
    double q[16] = {0}, u[3], end[3];
    drawn d;
    bend(l.model, q);
    draw(l.model, q, &d);
    for (int b = 1; b < 3; b++) {
        const int tip = kmp_drawing_point(&d.drawing, l.model, point_named(l.model, b, "end")).body;
        CHECK(d.drawing.places[tip - d.drawing.body_count].held);
        displacement(&d, b, 16, length[b], end);
        for (int k = 0; k <= 16; k++) {
            displacement(&d, b, k, length[b] * k / 16, u);
            for (int i = 0; i < 3; i++)
                CHECK_NEAR(shift_of(&d, b, k)[i], u[i] - end[i] * k / 16, 1e-14);
        }
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(d.shift[3 * (tip - d.drawing.body_count) + i], 0, 0);
        CHECK(fabs(shift_of(&d, b, 8)[0]) + fabs(shift_of(&d, b, 8)[1]) > 0.002);
    }
    wipe(&d);
    unload(&l);
}

/* A still picture has the pieces, in the colour of their body. */
static void still_pictures_have_pieces(void)
{
    loaded l = load_text(open_chain);
    double q[16] = {0};
    kmp_text svg = {0};
    bend(l.model, q);
    CHECK(kmp_mechanism_picture(&svg, l.model, q, 200));
    char words[64];
    for (int b = 1; b < 3; b++) {
        int count = 0;
        (void)snprintf(words, sizeof words, "fill=\"none\" stroke=\"%s\"", kmp_plot_colour(b - 1));
        for (const char *s = svg.s; (s = strstr(s, words)); s++)
            count++;
        CHECK(count == (b == 1 ? 17 : 16)); /* and one to the point beside the arm */
    }
    kmp_text_free(&svg);
    unload(&l);
}

/* -- the page ---------------------------------------------------------------------------------------------- */

static char folder[] = "/tmp/kempe_report_XXXXXX";

static int occurrences(const char *text, const char *word)
{
    int count = 0;
    for (const char *s = text; (s = strstr(s, word)); s++)
        count++;
    return count;
}

static char *written(const kempe_comparison *c)
{
    char path[256], *text = NULL;
    size_t length;
    kempe_context *context = kempe_context_new();
    snprintf(path, sizeof path, "%s/page.html", folder);
    CHECK(kempe_comparison_write_report(c, path) == KEMPE_OK);
    CHECK(kmp_file_read(context, KMP_FILE_RECORD, path, &text, &length) == KEMPE_OK);
    unlink(path);
    kempe_context_free(context);
    return text;
}

/* The build embeds it in pieces: none is lost or changed. */
static void contains_file(const char *page, const char *path)
{
    char *text = NULL;
    size_t length = 0;
    kempe_context *context = kempe_context_new();
    CHECK(kmp_file_read(context, KMP_FILE_RECORD, path, &text, &length) == KEMPE_OK);
    CHECK(length > 100000 && strstr(page, text) != NULL);
    kmp_free(text);
    kempe_context_free(context);
}

static void page_holds_together(void)
{
    static const char model[] =
        "kempe: 1\nname: </script><b>&\ngravity: [0, -9.81, 0]\nground: {points: {O: [0, 0, 0]}}\n"
        "bodies:\n  a: {joint: {name: A, revolute: z, at: ground.O}, mass: 1, com: [1, 0, 0], "
        "inertia: {zz: 1}}\nrun: {t_end: 0.5}\n";
    loaded l = load_text(model);
    kempe_comparison *c = compare(l.system, "1e-4,1e-6", 0.5);
    char *page = written(c), *again = written(c);
    CHECK(strstr(page, "<title>&lt;/script&gt;&lt;b&gt;&amp;: comparison</title>") != NULL);
    contains_file(page, KEMPE_ROOT "/third_party/three/three.min.js");
    contains_file(page, KEMPE_ROOT "/third_party/chart/chart.min.js");
    CHECK(occurrences(page, "<script") == 4 && occurrences(page, "</script>") == 4);
    CHECK(occurrences(page, "/*DATA*/") + occurrences(page, "/*SCRIPT*/") + occurrences(page, "<!--STYLE-->") == 0);
    CHECK_TEXT(page, again);
    kmp_free(page);
    kmp_free(again);
    kempe_comparison_free(c);
    unload(&l);
}

int main(void)
{
    TEST(poses_are_the_positions);
    TEST(poses_of_turned_joints);
    TEST(quaternions_are_the_rotations);
    TEST(pins_are_axes_of_hinges);
    TEST(pins_of_cut_hinges);
    TEST(numbers_in_few_characters);
    TEST(runs_are_watched);
    TEST(a_spin_is_shown_whole);
    TEST(happenings_are_kept);
    TEST(parts_have_rows);
    TEST(drawing_of_a_slider);
    TEST(curves_are_where_points_are);
    TEST(chains_deform_as_a_whole);
    TEST(loops_hold_places);
    TEST(still_pictures_have_pieces);
    if (!mkdtemp(folder))
        return 1;
    TEST(page_holds_together);
    rmdir(folder);
    return check_report();
}
