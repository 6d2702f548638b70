/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: slow not_sanitized 34 */
/* Generated simulators of models of the examples, as programs of their own: their motions are those of the library, and
 * the bits do not depend on the times at which a caller looks, nor on saving and restoring. */
#include "full.h"
#include "generate/compiled_equations.h"
#include "generate/models.h"
#include "model/data/variant.h"
#include "sanitized.h"
#include <kempe/settings.h>
#include <kempe/stepper.h>
#include <math.h>

/* Programs are built without sanitizers: under them the library takes a sample of the models. */
#ifdef SANITIZED
#define EVERY 3
#else
#define EVERY 1
#endif

/* Both integrate with a tolerance of 1e-10; the motions multiply its errors. */
#define TOLERANCE "1e-10"
#define ALLOWED   1e-6
/* Slopes and accelerations at one place, by two ways of the linear algebra. */
#define SLOPES_ALLOWED 1e-12

/* Folder of the examples (NULL: the models of tests), name, time in s, slopes: redundant rows, exchanges of
 * coordinates, conditions, drives and locks, spatial loops, states, forces that depend on reactions, wheels on rails,
 * algebraic unknowns, several loops, a robot's links, samples of states, events of states, both with events that follow
 * others at one time, kinks; friction that sticks: with a screw and a control, at rest under a load that varies, in two
 * loops that are redundant, with a level by reactions, in a guide, of several elements, on a driven belt; rigid
 * contacts: with a stop, feet, slip that rolls, rows between rates, rebounds that accumulate, two that strike at one
 * time, one at the instant of an event of a state, in a sphere, of a loop, at a wall, on a cam, in slots, on a polygon,
 * on teeth; flexible bodies with a taper, from a static start, in mean axes. */
static const struct {
    const char *folder, *name;
    double time;
    int slopes; /* choices of coordinates that have them, at least */
} models[] = {{"four_bar", "four_bar", 5, 2},
              {"andrews", "andrews", 0.03, 1},
              {"slider_crank", "slider_crank", 3, 1},
              {"bricard", "bricard", 10, 1},
              {"delta_robot", "delta_robot", 1, 2},
              {"parallel_robot", "parallel_robot_spatial", 2, 1},
              {"excavator", "excavator", 1, 2},
              {"driven_slider_crank", "driven_slider_crank", 2, 0},
              {"loose_slider", "loose_slider", 0.01, 1},
              {"quarter_car", "quarter_car", 3, 1},
              {"cart_pole", "cart_pole", 3, 1},
              {"robot_leg", "robot_leg", 0.5, 1},
              {"restrained_wheelset", "wheelset_on_rails", 0.2, 0},
              {"wheelset", "wheelset", 1, 0},
              {"rolling_wheel", "rolling_wheel", 0.05, 0},
              {"bogie_track", "bogie_track", 0.1, 0},
              {"curving", "curving", 0.05, 0},
              {"manchester", "manchester", 0.02, 0},
              {"hydraulic_excavator", "hydraulic_excavator", 0.4, 1},
              {"loose_pin", "loose_pin", 0.002, 1},
              {NULL, "discrete_slide", 3, 1},
              {NULL, "kinks", 10, 1},
              {"stick_slip", "stick_slip", 2, 1},
              {"clutch_start", "clutch_start", 1, 0},
              {NULL, "friction_incline", 2, 1},
              {NULL, "friction_pair", 2, 0},
              {NULL, "friction_pin", 2, 0},
              {NULL, "friction_guide_mu", 2, 0},
              {NULL, "friction_rod", 2, 0},
              {NULL, "friction_stack", 2, 0},
              {NULL, "friction_belt", 2, 0},
              {"toggle_press", "toggle_press", 1, 0},
              {"jansen_walker", "jansen_walker", 2, 0},
              {"bowling_ball", "bowling_ball", 2.5, 0},
              {NULL, "contact_bounce", 4, 0},
              {NULL, "contact_corners", 1.25, 0},
              {NULL, "contact_loop", 1, 0},
              {NULL, "contact_slider_crank", 1, 0},
              {NULL, "contact_coin", 1, 0},
              {NULL, "contact_wall", 2, 0},
              {"valve_train", "valve_train", 0.025, 0},
              {"geneva_drive", "geneva_drive", 0.5, 0},
              {NULL, "contact_polygon", 1.4, 0},
              {NULL, "contact_teeth", 0.4, 0},
              {NULL, "closed_arm", 2, 1},
              {NULL, "contact_noted", 0.8, 0},
              {NULL, "tapered_arm", 0.5, 0},
              {NULL, "floating_beam", 0.1, 0}};

static bool exists(const char *path)
{
    FILE *file = fopen(path, "r");
    return file && fclose(file) == 0;
}

static kempe_model *model_of(const char *in, const char *name)
{
    kempe_model *model = NULL;
    char path[1024];
    if (in)
        snprintf(path, sizeof path, "%s/examples/%s/%s.yaml", KEMPE_ROOT, in, name);
    else
        snprintf(path, sizeof path, "%s/tests/models/%s.yaml", KEMPE_ROOT, name);
    CHECK(exists(path) && kempe_model_read(context, path, &model) == KEMPE_OK);
    return model;
}

static bool has_file(const kempe_code *code, const char *name)
{
    for (int k = 0; k < kempe_code_file_count(code); k++)
        if (strcmp(kempe_code_file_name(code, k), name) == 0)
            return true;
    return false;
}

/* The simulator's program; the name of the model as an identifier. Each common source is compiled again only where it
 * differs from that of a model before. Equations of many lines are read by the compiler for its warnings, and compiled
 * by clang, which takes a third of its time, where that is installed; test_wheel_equations compiles such equations. */
static bool build(const kempe_model *model, char name[256])
{
    const kempe_generate_options g = {.simulator = 1, .language = "c"};
    char long_code[512];
    static const char *const parts[] = {"kempe_simulator", "kempe_friction", "kempe_charts", "kempe_events"};
    char sources[128] = "", objects[128] = "", command[4096];
    kempe_code *code = NULL;
    if (kempe_code_new(model, &g, &code) != KEMPE_OK || kempe_code_write(code, folder) != KEMPE_OK) {
        printf("%s\n", kempe_context_message(context));
        kempe_code_free(code);
        return false;
    }
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++) {
        char file[64];
        snprintf(file, sizeof file, "%s.c", parts[k]);
        if (has_file(code, file)) {
            snprintf(sources + strlen(sources), sizeof sources - strlen(sources), " %s", parts[k]);
            snprintf(objects + strlen(objects), sizeof objects - strlen(objects), " %s.o", parts[k]);
        }
    }
    snprintf(name, 256, "%.*s", (int)strcspn(kempe_code_file_name(code, 0), "."), kempe_code_file_name(code, 0));
    kempe_code_free(code);
    snprintf(long_code, sizeof long_code,
             "test $(wc -c <%s.c) -gt 100000 && command -v clang >/dev/null && clang -std=c99 -ffp-contract=off -Wall "
             "-Wextra -Wpedantic -Wconversion -Wshadow -Werror -I. -O0 -c %s.c && $compile -fsyntax-only %s.c",
             name, name, name);
    snprintf(
        command, sizeof command,
        "cd %s && compile='%s -std=c99 -ffp-contract=off -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror -I.' "
        "&& for part in%s; do cat $part.c kempe_simulator.h kempe_runtime.h >text && { cmp -s text $part.text || "
        "{ $compile -O1 -c $part.c && mv text $part.text; } || exit 1; }; done "
        "&& { %s || $compile -O0 -c %s.c; } && $compile -O0 -DMODEL=%s -DMODEL_HEADER='\"%s_simulator.h\"' -o run "
        "%s/tests/generate/simulated_run.c %s.o %s_simulator.c%s -lm",
        folder, KEMPE_CC, sources, long_code, name, name, name, KEMPE_ROOT, name, name, objects);
    return runs(command);
}

/* Lines of a run with a tolerance; the numbers of it. */
static int run_to(const char *tolerance, double time, int parts, const char *more, char line[MOST_OUT], double *x)
{
    char command[2048];
    int count = 0;
    snprintf(command, sizeof command, "%s/run %.17g %s %d %s 2>%s/said", folder, time, tolerance, parts, more, folder);
    FILE *pipe = popen(command, "r");
    bool told = pipe && fgets(line, MOST_OUT, pipe);
    CHECK(told && pclose(pipe) == 0);
    for (char *at = line; told && *at && *at != '\n' && count < MOST; at += strspn(at, " "))
        x[count++] = strtod(at, &at);
    return count;
}

static int run_it(double time, int parts, const char *more, char line[MOST_OUT], double *x)
{
    return run_to(TOLERANCE, time, parts, more, line, x);
}

static void compare(const kempe_model *model, const char *name, double time, const double *x)
{
    const kempe_run_options run = {.t_end = time, .rtol = 1e-10, .atol = 1e-10};
    kempe_system *system = NULL;
    kempe_stepper *stepper = NULL;
    double most = 0;
    CHECK(kempe_system_new(model, &system) == KEMPE_OK && kempe_stepper_new(system, &run, &stepper) == KEMPE_OK &&
          kempe_stepper_advance(stepper, time) == KEMPE_OK);
    const int n = kempe_model_coordinate_count(model);
    for (int k = 0; stepper && k < n; k++) {
        const double q = kempe_stepper_q(stepper)[k], qd = kempe_stepper_qd(stepper)[k];
        most = fmax(most, fabs(x[1 + k] - q) / (1 + fabs(q)));
        most = fmax(most, fabs(x[1 + n + k] - qd) / (10 + fabs(qd)));
    }
    printf("  %-26s %.1e off the library\n", name, most);
    CHECK(x[0] == time && most <= ALLOWED);
    kempe_stepper_free(stepper);
    kempe_system_free(system);
}

/* The slopes of the last run, which it compares with its accelerations and rates; their number. */
static int check_slopes(const char *name)
{
    char path[256];
    int count = -1;
    double off = INFINITY;
    snprintf(path, sizeof path, "%s/said", folder);
    FILE *said = fopen(path, "r");
    CHECK(said && fscanf(said, "%d slopes, %lf off", &count, &off) == 2 && off <= SLOPES_ALLOWED);
    printf("  %-26s %d slopes, %.1e off the accelerations\n", name, count, off);
    if (said)
        fclose(said);
    return count;
}

static void simulate(const char *in, const char *model_name, double time, int slopes)
{
    static char whole[MOST_OUT], parts[MOST_OUT];
    static double x[MOST], y[MOST];
    char name[256];
    kempe_model *model = model_of(in, model_name);
    bool built = model && build(model, name);
    CHECK(built);
    if (built && run_it(time, 1, "", whole, x) > 1) {
        compare(model, model_name, time, x);
        CHECK(check_slopes(model_name) >= slopes);
        CHECK(run_it(time, 317, "exchange", parts, y) > 1 && strcmp(whole, parts) == 0);
    }
    kempe_model_free(model);
}

static void motions_are_those_of_the_library(void)
{
    for (size_t k = 0; k < sizeof models / sizeof *models; k += check_full() ? 1 : EVERY)
        simulate(models[k].folder, models[k].name, models[k].time, models[k].slopes);
}

/* With other parameters a simulator starts as the library does: coordinates that the model keeps, and given rates, move
 * with them. */
static void starts_move(void)
{
    static const char *const names[] = {"angle", "spin", "swing", "reach"};
    static const double values[] = {1.1, -2, 0.5, 0.25};
    static char line[MOST_OUT];
    static double x[MOST];
    char name[256];
    kempe_model *model = model_of(NULL, "moved_start"), *moved = NULL;
    CHECK(model && kmp_variant_instance(model, 4, names, values, &moved) == KEMPE_OK && build(model, name));
    if (moved && run_it(1, 1, "angle=1.1 spin=-2 swing=0.5 reach=0.25", line, x) > 1)
        compare(moved, "moved_start", 1, x);
    kempe_model_free(moved);
    kempe_model_free(model);
}

/* With other parameters the deformations of a start are in balance with other loads: a rod in a loop, of another
 * stiffness, weight, speed and crank. Beyond the load at which it buckles there is no start. */
static void starts_balance(void)
{
    static const char *const names[] = {"E", "g", "w", "a"};
    static const double values[] = {5e9, 5, 9, 0.22};
    static char line[MOST_OUT];
    static double x[MOST];
    char name[256], command[512];
    kempe_model *model = NULL, *moved = NULL;
    CHECK(
        kempe_model_read_text(
            context,
            "kempe: 1\nname: balanced\ngravity: [0, -g, 0]\nparameters: {E: 7e9, g: 9.81, w: 3, a: 0.2, push: 200}\n"
            "bodies:\n  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, inertia: {zz: 0.1}, points: {E: "
            "[a, 0, 0]}}\n  rod:\n    joint: {name: B, revolute: z, at: crank.E}\n"
            "    flexible: {beam: {length: 0.5, young: E, density: 2700, section: {rectangle: [0.006, 0.02]}}, shapes: "
            "{y: 2}, frame: chord, raw: yes}\n    points: {tip: {station: 0.5}}\n"
            "  slider: {joint: {name: X, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
            "loops: {C: {ball: [rod.tip, slider.P]}}\nforces: {s: {joint: X, force: push*(0.5 - q(X))}}\n"
            "start: {elastic: static, q: {A: 1, B: -1.3, X: 0.6}, hold: [A], qd: {A: w}}\n",
            "balanced.yaml", &model) == KEMPE_OK &&
        kmp_variant_instance(model, 4, names, values, &moved) == KEMPE_OK && build(model, name));
    if (moved && run_it(0.01, 1, "E=5e9 g=5 w=9 a=0.22", line, x) > 1)
        compare(moved, "balanced", 0.01, x);
    snprintf(command, sizeof command,
             "cd %s && ! ./run 0.01 1e-8 1 push=1e5 >out 2>said && grep -q 'find no stable balance' said", folder);
    CHECK(runs(command));
    kempe_model_free(moved);
    kempe_model_free(model);
}

/* The start of a simulator is the equilibrium of its model, with the state there. */
static void starts_are_at_equilibria(void)
{
    static char line[MOST_OUT];
    static double x[MOST];
    char name[256];
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(
              context,
              "kempe: 1\nname: resting\ngravity: [0, -9.81, 0]\nparameters: {k: 30}\n"
              "states: {sum: {rate: '-3*q(A)'}}\n"
              "bodies:\n  crank: {joint: {name: A, revolute: z, at: ground}, mass: 1, com: [0.1, 0, 0], inertia: {zz: "
              "0.1}, points: {E: [0.2, 0, 0]}}\n"
              "  rod: {joint: {name: B, revolute: z, at: crank.E}, mass: 1, inertia: {zz: 0.1}, points: {tip: [0.5, 0, "
              "0]}}\n  slider: {joint: {name: X, prismatic: x, at: ground}, mass: 1, points: {P: [0, 0, 0]}}\n"
              "loops: {C: {ball: [rod.tip, slider.P]}}\nforces: {s: {joint: A, torque: 'sum - k*q(A) - 2*qd(A)'}}\n"
              "start: {q: {A: 0.5, B: -0.7, X: 0.6}, qd: {A: 2}, at: equilibrium}\n",
              "resting.yaml", &model) == KEMPE_OK &&
          build(model, name));
    if (run_it(1, 1, "", line, x) > 1)
        compare(model, "resting", 1, x);
    kempe_model_free(model);
}

/* A flywheel turns many times within a step: the simulator and the library show the angle with all turns. */
static void turns_within_a_step(void)
{
    static char line[MOST_OUT];
    static double x[MOST];
    char name[256];
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(
              context,
              "kempe: 1\nname: flywheel\ngravity: [0, 0, 0]\nbodies: {a: {joint: {name: J, spherical: z, "
              "at: ground}, mass: 1, inertia: {xx: 0.1, yy: 0.1, zz: 0.1}}}\n"
              "start: {q: {J.2: 1.5}, qd: {J.3: 100}}\n",
              "flywheel.yaml", &model) == KEMPE_OK &&
          build(model, name));
    if (run_to("1e-6", 1, 1, "", line, x) > 1)
        CHECK(fabs(x[3] - 100) < 1e-3);
    if (run_it(1, 1, "", line, x) > 1)
        compare(model, "flywheel", 1, x);
    kempe_model_free(model);
}

/* A hill that is much narrower than the steps gives 2 kg its work: at coarse tolerances too, a step that meets it is
 * made again up to it. */
static void narrow_hills(void)
{
    static char line[MOST_OUT];
    static double x[MOST];
    char name[256];
    kempe_model *model = NULL;
    CHECK(kempe_model_read_text(
              context,
              "kempe: 1\nname: hill\nbodies: {m: {joint: {name: x, prismatic: x, at: ground}, mass: 2}}\n"
              "forces: {f: {joint: x, force: \"exp(-((q(x) - 3.4567)/0.004)^2)/0.004\"}}\n"
              "start: {q: {x: 0}, qd: {x: 1}}\nrun: {t_end: 12}\n",
              "hill.yaml", &model) == KEMPE_OK &&
          build(model, name));
    CHECK(run_to("1e-6", 12, 1, "", line, x) > 2);
    CHECK_NEAR(x[2], sqrt(1 + sqrt(acos(-1))), 1e-5);
    kempe_model_free(model);
}

/* Models with parts that simulators lack are refused with the name of the part. */
static void refusals(void)
{
    const kempe_generate_options g = {.simulator = 1, .language = "c"};
    kempe_code *code = NULL;
    kempe_model *model = model_of(NULL, "delayed_slides");
    CHECK(kempe_code_new(model, &g, &code) == KEMPE_E_ARGUMENT && strstr(kempe_context_message(context), "'seen'"));
    kempe_code_free(code);
    kempe_model_free(model);
}

/* True if motions_are_those_of_the_library has written the simulator of this model. */
static bool is_simulated(const char *path)
{
    for (size_t k = 0; k < sizeof models / sizeof *models; k += check_full() ? 1 : EVERY) {
        kmp_text own = {0};
        kmp_text_printf(&own, models[k].folder ? "examples/%s/%s.yaml" : "tests/models/%.0s%s.yaml",
                        models[k].folder ? models[k].folder : "", models[k].name);
        const bool same = own.s && strcmp(own.s, path) == 0;
        kmp_text_free(&own);
        if (same)
            return true;
    }
    return false;
}

/* Each model of the tests and examples is written, or refused with a sentence on its part. */
static void every_model_has_an_answer(void)
{
    static char *paths[MOST_MODELS];
    const kempe_generate_options g = {.simulator = 1, .language = "c"};
    const int count = models_list(paths);
    int written = 0;
    for (int k = 0; k < count; k++) {
        kempe_model *model = NULL;
        kempe_code *code = NULL;
        if (is_simulated(paths[k])) {
            written++;
        } else if (kempe_model_read(context, paths[k], &model) == KEMPE_OK) {
            const bool made = kempe_code_new(model, &g, &code) == KEMPE_OK;
            const char *message = kempe_context_message(context);
            const bool told = made || strstr(message, "simulators: ") || strstr(message, ".yaml:");
            written += made;
            if (!told)
                printf("  %s: %s\n", paths[k], message);
            CHECK(told);
        }
        kempe_code_free(code);
        kempe_model_free(model);
        kmp_free(paths[k]);
    }
    CHECK(4 * written > 3 * count);
}

int main(void)
{
    context = kempe_context_new();
    CHECK(kempe_context_set_left_out(context, "colour") == KEMPE_OK); /* of closed_arm.yaml */
    if (!mkdtemp(folder))
        return 1;
    TEST(motions_are_those_of_the_library);
    TEST(starts_move);
    TEST(starts_balance);
    TEST(starts_are_at_equilibria);
    TEST(turns_within_a_step);
    TEST(narrow_hills);
    TEST(refusals);
    TEST(every_model_has_an_answer);
    char command[128];
    snprintf(command, sizeof command, "rm -r %s", folder);
    CHECK(runs(command));
    kempe_context_free(context);
    return check_report();
}
