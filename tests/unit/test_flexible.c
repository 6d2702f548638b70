/* SPDX-License-Identifier: BSD-3-Clause */
/* ctest: 5 */
/* Flexible bodies against digits of other programs and closed forms: a pendulum and a five-bar robot whose links bend,
 * a slider-crank whose rod bends in both planes and twists, by all algorithms and formulations; frequencies of rotating
 * beams and spinning shafts; beam-columns. Digits are those of programs with independent equations (Lagrange's, by
 * automatic derivatives), of which two tolerances agree to the digits given. */
#include "base/text.h"
#include "loaded.h"
#include "testing.h"
#include <kempe/equilibrium.h>
#include <kempe/modes.h>
#include <kempe/table.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* -- runs ---------------------------------------------------------------------------------------------- */

/* A value of an output at a time. */
typedef struct digit {
    double t;
    const char *output;
    double value, allowed;
} digit;

/* At a row; a last ".k" is the number of a multiplier. */
static void check_digit(const kempe_trajectory *t, int row, const digit *d)
{
    kempe_table *table = NULL;
    char name[64];
    int component = 1;
    (void)snprintf(name, sizeof name, "%s", d->output);
    char *end = strchr(name, ')') + 1;
    if (strncmp(name, "lambda", 6) == 0) {
        component = atoi(end + 1);
        *end = '\0';
    }
    CHECK(kempe_trajectory_outputs(t, name, &table) == KEMPE_OK && row < kempe_table_row_count(table));
    const double value = table ? kempe_table_number(table, row, component) : NAN;
    if (!(fabs(value - d->value) <= d->allowed))
        printf("%s at %g: %.15g, expected %.15g, off %.2g\n", d->output, d->t, value, d->value, value - d->value);
    CHECK(fabs(value - d->value) <= d->allowed);
    kempe_table_free(table);
}

/* Runs a model to the last of these times and compares; all times are multiples of `step`. */
static void check_run(const char *text, const kempe_run_options *how, double step, const digit *list, int count)
{
    loaded l = load_text(text);
    kempe_run_options run = *how;
    kempe_trajectory *t = NULL;
    run.output_step = step;
    run.t_end = list[count - 1].t;
    run.no_convergence_check = 1;
    CHECK(l.system && kempe_simulate(l.system, &run, &t) == KEMPE_OK);
    if (!t)
        printf("%s\n", kempe_context_message(l.context));
    for (int k = 0; t && k < count; k++)
        check_digit(t, (int)lround(list[k].t / step), &list[k]);
    kempe_trajectory_free(t);
    unload(&l);
}

/* Each formulation, and each algorithm of the dynamics where that differs. */
static const kempe_run_options ways[] = {
    {.rtol = 1e-12, .integrator = "radau"},
    {.rtol = 1e-12, .integrator = "dop853"},
    {.rtol = 1e-12, .integrator = "dop853", .formulation = "projected"},
    {.rtol = 1e-12, .integrator = "radau", .formulation = "dae"},
};
enum { WAYS = sizeof ways / sizeof *ways };

/* -- the pendulum -------------------------------------------------------------------------------------- */

static char *pendulum(const char *frame, int shapes, const char *stiffening)
{
    kmp_text text = {0};
    kmp_text_printf(&text,
                    "kempe: 1\ngravity: [0, -9.81, 0]\nbodies:\n  rod:\n    joint: {name: A, revolute: z, at: ground}\n"
                    "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: %d}, frame: %s, stiffening: %s}\n"
                    "    points: {tip: {station: 1}}\n",
                    shapes, frame, stiffening);
    return text.s;
}

/* The tip of a pendulum of length 1, rho A = 1, EI = 10 that falls from rest. */
static void falls_as_other_programs_say(void)
{
    static const struct {
        const char *frame;
        int shapes;
        const char *stiffening;
        double x[3], y[3];
    } list[] = {
        {"chord",
         1,
         "full",
         {0.898612271036, -0.088013995178, -0.999948623856},
         {-0.438707340238, -0.996108915125, -0.004120764557}},
        {"chord",
         2,
         "full",
         {0.898304753566, -0.087666055848, -0.999921748403},
         {-0.439353290336, -0.996135060709, -0.003029343847}},
        {"chord",
         3,
         "full",
         {0.897339381629, -0.093100334580, -0.999891565919},
         {-0.441339607445, -0.995626923019, -0.001972387672}},
        {"clamped",
         2,
         "full",
         {0.898299751153, -0.087666132643, -0.999921870632},
         {-0.439363775101, -0.996135054717, -0.003030939908}},
        {"chord",
         1,
         "first",
         {0.89861368150, -0.08801701152, -0.99994880318},
         {-0.43870435250, -0.99610868033, -0.00413124156}},
        {"chord",
         2,
         "first",
         {0.89830656409, -0.08766512654, -0.99992170026},
         {-0.43934949443, -0.99613513835, -0.00302672656}},
        {"clamped",
         2,
         "first",
         {0.89832137260, -0.08765290148, -0.99992161187},
         {-0.43931852255, -0.99613615550, -0.00300765132}},
    };
    for (size_t k = 0; k < sizeof list / sizeof *list; k++)
        for (int way = 0; way < WAYS; way++) {
            const double allowed = strcmp(list[k].stiffening, "full") == 0 ? 2e-11 : 3e-10;
            digit digits[6];
            for (int i = 0; i < 3; i++) {
                const double t = i == 0 ? 0.25 : i == 1 ? 0.5 : 1;
                digits[2 * i] = (digit){t, "position(rod.tip).x", list[k].x[i], allowed};
                digits[2 * i + 1] = (digit){t, "position(rod.tip).y", list[k].y[i], allowed};
            }
            char *text = pendulum(list[k].frame, list[k].shapes, list[k].stiffening);
            check_run(text, &ways[way], 0.25, digits, 6);
            free(text);
        }
}

/* -- the five-bar robot -------------------------------------------------------------------------------- */

static char *robot(int shapes, const char *stiffening, const char *algorithm)
{
    kmp_text text = {0};
    kmp_text_put(&text, "kempe: 1\ngravity: [0, 0, 0]\nground: {points: {O1: [0, 0, 0], O2: [0.5, 0, 0]}}\nbodies:\n");
    for (int i = 1; i <= 2; i++)
        kmp_text_printf(&text,
                        "  c%d: {joint: {name: A%d, revolute: z, at: ground.O%d}, mass: 0.6, inertia: {zz: 0.0125}, "
                        "points: {P: [0.25, 0, 0]}}\n"
                        "  l%d:\n    joint: {name: B%d, revolute: z, at: c%d.P}\n"
                        "    flexible: {beam: {length: 0.45, rhoA: 0.32, EIz: 6}, shapes: {y: %d}, frame: chord, "
                        "stiffening: %s}\n    points: {E: {station: 0.45}, M: {station: 0.225}}\n",
                        i, i, i, i, i, i, shapes, stiffening);
    kmp_text_put(&text, "  tool: {joint: {name: T, revolute: z, at: l1.E}, mass: 1.2, inertia: {zz: 0.001}, "
                        "points: {Q: [0, 0, 0]}}\n"
                        "loops: {L: {ball: [tool.Q, l2.E]}}\n"
                        "drives: {d1: {joint: A1, angle: \"2.2 - 0.5*sin(8*t)^2\"}, "
                        "d2: {joint: A2, angle: \"0.9 + 0.4*sin(8*t)^2\"}}\n"
                        "start: {q: {B1: -1.7381865298439, B2: 1.7640981195929}}\n");
    kmp_text_printf(&text, "run: {t_end: 0.4, algorithm: %s}\n", algorithm);
    return text.s;
}

/* The links as chains of rigid pieces: errors fall at least with the square of their number. */
static void segments_converge(void)
{
    static const char shapes[] = "shapes: {y: 3}, frame: chord, stiffening: first",
                      limit_of[] = "shapes: {y: 1}, segments: ";
    /* Of 16 and 32 pieces of equal length, written out, by Richardson's extrapolation. */
    const double limit = 0.509131217377;
    const kempe_run_options run = {.rtol = 1e-10, .integrator = "radau"};
    for (int pieces = 4; pieces <= 32; pieces *= 2) {
        char *text = robot(3, "first", "auto");
        kmp_text made = {0};
        for (const char *at = text, *found; *at; at = found ? found + sizeof shapes - 1 : at + strlen(at)) {
            found = strstr(at, shapes);
            kmp_text_printf(&made, "%.*s", found ? (int)(found - at) : (int)strlen(at), at);
            if (found)
                kmp_text_printf(&made, "%s%d", limit_of, pieces);
        }
        const double allowed = 4.5e-6 / (pieces * pieces);
        check_run(made.s, &run, 0.05, &(digit){0.1, "position(tool.Q).y", limit, allowed}, 1);
        kmp_text_free(&made);
        free(text);
    }
}

static void robot_moves_as_other_programs_say(void)
{
    static const digit full_2[] = {{0.1, "position(tool.Q).x", 0.264400778195, 2e-12},
                                   {0.1, "position(tool.Q).y", 0.509131186831, 2e-12},
                                   {0.1, "deflection(l1.M).y", -1.8278928718e-04, 1e-11},
                                   {0.1, "lambda(L).1", -5.63311084, 2e-8},
                                   {0.1, "lambda(L).2", 4.85498746, 2e-8},
                                   {0.1, "lambda(d1).1", 2.088430507, 2e-8},
                                   {0.1, "lambda(d2).1", -1.982819256, 2e-8},
                                   {0.4, "position(tool.Q).x", 0.255789972423, 2e-12},
                                   {0.4, "position(tool.Q).y", 0.403462772248, 2e-12},
                                   {0.4, "lambda(L).1", 37.26689989, 5e-8}};
    static const digit full_3[] = {{0.05, "position(tool.Q).x", 0.258232060470, 2e-12},
                                   {0.05, "position(tool.Q).y", 0.437835976565, 2e-12},
                                   {0.1, "position(tool.Q).x", 0.264400712953, 2e-12},
                                   {0.1, "deflection(l2.M).y", -1.5566395324e-04, 2e-11},
                                   {0.2, "position(tool.Q).y", 0.580077339861, 2e-12},
                                   {0.2, "lambda(d1).1", 3.855300931, 3e-8},
                                   {0.4, "position(tool.Q).x", 0.255789999011, 2e-12},
                                   {0.4, "position(tool.Q).y", 0.403457125264, 2e-12},
                                   {0.4, "lambda(L).2", -18.21285777, 5e-8},
                                   {0.4, "lambda(d2).1", 11.742512690, 5e-8}};
    static const digit first_3[] = {{0.05, "position(tool.Q).x", 0.258232060437, 2e-12},
                                    {0.1, "position(tool.Q).x", 0.264400712972, 2e-12},
                                    {0.1, "position(tool.Q).y", 0.509131225500, 2e-12},
                                    {0.1, "deflection(l1.M).y", 2.0212455917e-04, 2e-11},
                                    {0.4, "position(tool.Q).x", 0.255789999179, 2e-12},
                                    {0.4, "position(tool.Q).y", 0.403457120580, 2e-12},
                                    {0.4, "lambda(L).1", 39.21887892, 5e-8},
                                    {0.4, "lambda(d1).1", -12.666641987, 5e-8}};
    static const char *const algorithms[] = {"auto", "ner", "articulated"};
    for (int way = 0; way < WAYS; way++) {
        kempe_run_options run = ways[way];
        run.rtol = 1e-13;
        for (int a = 0; a < (way < 2 ? 3 : 1); a++) {
            char *text[] = {robot(2, "full", algorithms[a]), robot(3, "full", algorithms[a]),
                            robot(3, "first", algorithms[a])};
            check_run(text[0], &run, 0.05, full_2, 10);
            check_run(text[1], &run, 0.05, full_3, 10);
            check_run(text[2], &run, 0.05, first_3, 8);
            for (int k = 0; k < 3; k++)
                free(text[k]);
        }
    }
}

/* -- the spatial slider-crank -------------------------------------------------------------------------- */

static char *slider_crank(const char *stiffening, const char *algorithm)
{
    kmp_text text = {0};
    kmp_text_printf(&text,
                    "kempe: 1\ngravity: [0, 0, -9.81]\nground: {points: {S: [0, 0.02, -0.03]}}\nbodies:\n"
                    "  crank: {joint: {name: A, revolute: x, at: ground}, mass: 0.1, inertia: {xx: 0.001}, "
                    "points: {P: [0, 0.1, 0]}}\n"
                    "  rod:\n    joint: {name: B, motions: [R3, R2], coordinates: [B1, B2], at: crank.P}\n"
                    "    flexible:\n      beam: {length: 0.4, young: 7 GPa, shear: 2.6 GPa, density: 1500, section: "
                    "{numbers: {A: 9.6e-5, Iy: 5.12e-10, Iz: 1.152e-9, J: 1.2e-9}}}\n"
                    "      shapes: {y: 2, z: 2, torsion: 1}\n      raw: yes\n      rotary: yes\n      stiffening: %s\n"
                    "    points: {E: {station: 0.4, offset: [0, 0.02, 0]}}\n"
                    "  slider: {joint: {name: X, prismatic: x, at: ground.S}, mass: 0.4, points: {C: [0, 0, 0]}}\n"
                    "loops: {L: {ball: [slider.C, rod.E]}}\ndrives: {d: {joint: A, angle: 50*t}}\n"
                    "start: {q: {B1: -0.2518, B2: 0.0751, X: 0.3913}}\nrun: {t_end: 0.2, algorithm: %s}\n",
                    stiffening, algorithm);
    return text.s;
}

static void rod_bends_and_twists_as_another_program_says(void)
{
    static const digit full[] = {
        {0.02, "q(B1)", -0.3367971970831, 3e-13},         {0.02, "q(X)", 0.3824633820877, 3e-13},
        {0.02, "q(rod.y1)", -1.557159675508e-03, 1e-13},  {0.02, "q(rod.z2)", 2.720356897139e-04, 1e-13},
        {0.02, "q(rod.phi1)", 1.692365071235e-04, 5e-13}, {0.02, "lambda(L).1", 3.641540778, 5e-9},
        {0.05, "q(B2)", -0.0334358467935, 3e-13},         {0.05, "q(rod.y2)", 9.643789577465e-04, 1e-13},
        {0.1, "q(B1)", -0.2028219535852, 3e-13},          {0.1, "q(rod.phi1)", -1.882203864101e-03, 1e-12},
        {0.2, "q(B1)", -0.3045059801011, 5e-13},          {0.2, "q(X)", 0.3859945478990, 5e-13},
        {0.2, "q(rod.z1)", -2.505214512928e-03, 5e-13},   {0.2, "lambda(L).3", 0.212314554, 1e-8}};
    static const digit first[] = {
        {0.02, "q(B1)", -0.3367794815327, 3e-13},          {0.02, "q(rod.y2)", -6.624509999496e-05, 1e-13},
        {0.02, "q(rod.phi1)", -1.230804147594e-03, 5e-13}, {0.02, "lambda(L).1", 3.442491234, 5e-9},
        {0.1, "q(B1)", -0.2042035653013, 3e-13},           {0.1, "q(rod.y1)", -2.979471086514e-03, 5e-13},
        {0.1, "q(rod.phi1)", -1.902962806557e-03, 1e-12},  {0.1, "lambda(L).3", 5.750103327, 1e-8}};
    static const char *const algorithms[] = {"auto", "ner", "articulated"};
    for (int way = 0; way < WAYS; way++)
        for (int a = 0; a < (way < 2 ? 3 : 1); a++) {
            kempe_run_options run = ways[way];
            run.rtol = 1e-13;
            /* Articulated bodies refuse `first` with torsion. */
            char *text[] = {slider_crank("full", algorithms[a]), slider_crank("first", algorithms[a > 1 ? 0 : a])};
            check_run(text[0], &run, 0.01, full, 14);
            check_run(text[1], &run, 0.01, first, 8);
            for (int k = 0; k < 2; k++)
                free(text[k]);
        }
}

/* -- small motions ------------------------------------------------------------------------------------- */

/* The frequencies of modes `index` (from 0), rad/s. */
static void check_frequencies(const char *text, const kempe_setting *set, const int *index, const double *expected,
                              int count, double allowed)
{
    kempe_context *context = kempe_context_new();
    loaded l = {.context = context};
    CHECK(kempe_model_read_text_set(context, text, "model.yaml", set, set ? 1 : 0, &l.model) == KEMPE_OK);
    l = load_finish(l);
    kempe_modes *modes = NULL;
    kempe_table *table = NULL;
    CHECK(l.system && kempe_modes_new(l.system, NULL, &modes) == KEMPE_OK &&
          kempe_modes_table(modes, "modes", &table) == KEMPE_OK);
    for (int k = 0; table && k < count; k++)
        CHECK_NEAR(fabs(kempe_table_number(table, 2 * index[k], kempe_table_find(table, "im"))), expected[k], allowed);
    kempe_table_free(table);
    kempe_modes_free(modes);
    unload(&l);
}

/* A cantilever on a hub of radius r that turns at eta sqrt(EI/(rho A L^4)): it stiffens. Exact values by power series;
 * in the plane of the rotation eta^2 less (lag). */
static void rotating_beams_stiffen(void)
{
    static const char model[] =
        "kempe: 1\ngravity: [0, 0, 0]\nparameters: {eta: 4, r: 0}\nbodies:\n"
        "  hub: {joint: {name: H, revolute: z, at: ground}, mass: 1, inertia: {zz: 1}, points: {P: [r, 0, 0]}}\n"
        "  blade:\n    joint: {weld: yes, at: hub.P}\n    flexible: {beam: {length: 1, rhoA: 1, EIz: 1, EIy: 1}, "
        "shapes: {y: 8, z: 8}, stiffening: %s}\ndrives: {spin: {joint: H, angle: eta*t}}\n";
    static const int first_two[] = {0, 1};
    static const struct {
        const char *eta;
        double lag, flap;
    } list[] = {{"2", 3.621796964126, 4.137319573027},
                {"4", 3.897722523716, 5.585001420937},
                {"10", 5.04897511774, 11.20232787146}};
    for (int full = 0; full < 2; full++)
        for (size_t k = 0; k < sizeof list / sizeof *list; k++) {
            char text[1024];
            const kempe_setting set = {"eta", list[k].eta};
            (void)snprintf(text, sizeof text, model, full ? "full" : "first");
            check_frequencies(text, &set, first_two, (double[]){list[k].lag, list[k].flap}, 2, 1e-11);
        }
    /* On a hub, and without terms of second order, where rotation softens: lag^2 = w0^2 - eta^2. */
    char text[1024];
    (void)snprintf(text, sizeof text, model, "first");
    const kempe_setting hub = {"r", "1"};
    check_frequencies(text, &hub, (int[]){0}, (double[]){6.31477153628}, 1, 1e-11);
    (void)snprintf(text, sizeof text, model, "none");
    const kempe_setting slow = {"eta", "2"};
    check_frequencies(text, &slow, (int[]){0, 1}, (double[]){sqrt(pow(3.516015268500151, 2) - 4), 3.516015268500151}, 2,
                      1e-11);
}

/* A shaft of Rayleigh between bearings that spins, seen in its own axes: whirl forwards and backwards. */
static void shafts_whirl(void)
{
    static const char model[] =
        "kempe: 1\ngravity: [0, 0, 0]\nparameters: {Om: 1000}\nbodies:\n"
        "  rotor: {joint: {name: H, revolute: x, at: ground}, mass: 1, inertia: {xx: 1}, "
        "points: {O: {at: [0, 0, 0], axes: {z: x}}}}\n"
        "  shaft:\n    joint: {name: U, motions: [R3, R2], at: rotor}\n    flexible:\n"
        "      beam: {length: 1, young: 2.1e11, poisson: 0.3, density: 7850, section: {circle: 0.05}}\n"
        "      shapes: {y: 6, z: 6}\n      rotary: yes\n      frame: chord\n    points: {E: {station: 1}}\n"
        "loops: {bearing: {point_on_line: [rotor.O, shaft.E]}}\ndrives: {spin: {joint: H, angle: Om*t}}\n";
    static const struct {
        const char *rate;
        double w[4];
    } list[] = {{"0", {637.602521745, 637.602521745, 2544.585975533, 2544.585975533}},
                {"500", {138.372862145, 1136.833110935, 2047.653173709, 3041.522470051}},
                {"1000", {360.855867869, 1550.724064569, 1636.064629711, 3538.462657253}},
                {"2000", {556.876924234, 1359.310539164, 2634.530455996, 3827.748302069}}};
    for (size_t k = 0; k < sizeof list / sizeof *list; k++) {
        const kempe_setting set = {"Om", list[k].rate};
        check_frequencies(model, &set, (int[]){0, 1, 2, 3}, list[k].w, 4, 1e-10);
    }
}

/* A cantilever with a force across its end and a dead load along it: F L^3/3EI 3 (tan u - u)/u^3, u = sqrt(P/EI). */
static void columns_bend_as_their_load_says(void)
{
    static const char model[] =
        "kempe: 1\ngravity: [0, 0, 0]\nparameters: {P: 5}\nbodies:\n  rod:\n    joint: {weld: yes, at: ground}\n"
        "    flexible: {beam: {length: 1, rhoA: 1, EIz: 10}, shapes: {y: %d}}\n    points: {tip: {station: 1}}\n"
        "forces: {end: {at: rod.tip, force: [-P, 0.1, 0]}}\n";
    static const struct {
        int shapes;
        const char *load;
        double deflection, allowed;
    } list[] = {{2, "5", 4.167770419426e-3, 1e-14},    {4, "15", 8.430142701060e-3, 2e-14},
                {6, "5", 4.169204842745e-3, 1e-14},    {6, "15", 8.430146380844e-3, 2e-14},
                {8, "24", 1.203139523294708e-1, 1e-9}, {8, "-10", 2.384058440442352e-3, 1e-14}};
    for (size_t k = 0; k < sizeof list / sizeof *list; k++) {
        char text[1024], column[32];
        const kempe_setting set = {"P", list[k].load};
        loaded l = {.context = kempe_context_new()};
        kempe_equilibrium *e = NULL;
        kempe_table *table = NULL;
        double sum = 0;
        (void)snprintf(text, sizeof text, model, list[k].shapes);
        CHECK(kempe_model_read_text_set(l.context, text, "model.yaml", &set, 1, &l.model) == KEMPE_OK);
        l = load_finish(l);
        /* Doubted beyond a tenth of the length: what is left out is of third order there. */
        const kempe_status trust = list[k].deflection > 0.1 ? KEMPE_UNTRUSTED : KEMPE_OK;
        CHECK(l.system && kempe_equilibrium_new(l.system, NULL, &e) == trust &&
              kempe_equilibrium_table(e, "equilibria", &table) == KEMPE_OK);
        for (int i = 1; table && i <= list[k].shapes; i++) { /* each shape is 1 at the tip */
            (void)snprintf(column, sizeof column, "q.rod.y%d", i);
            sum += kempe_table_number(table, 0, kempe_table_find(table, column));
        }
        if (!(fabs(sum - list[k].deflection) <= list[k].allowed))
            printf("%d shapes, load %s: %.15g, expected %.15g\n", list[k].shapes, list[k].load, sum,
                   list[k].deflection);
        CHECK(fabs(sum - list[k].deflection) <= list[k].allowed);
        kempe_table_free(table);
        kempe_equilibrium_free(e);
        unload(&l);
    }
}

int main(void)
{
    TEST(falls_as_other_programs_say);
    TEST(robot_moves_as_other_programs_say);
    TEST(segments_converge);
    TEST(rod_bends_and_twists_as_another_program_says);
    TEST(rotating_beams_stiffen);
    TEST(shafts_whirl);
    TEST(columns_bend_as_their_load_says);
    return check_report();
}
