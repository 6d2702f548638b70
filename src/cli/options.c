/* SPDX-License-Identifier: BSD-3-Clause */
/* Option parsing. A new option is one row of `options`; help text, parser and suggestions follow from it.
 * Accepted: --name value, --name=value, -o value, and `--` before a file name that begins with a dash. */
#include "options.h"

#include <kempe/compare.h>
#include <kempe/settings.h>
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* Types of option values. The last ones are files, whose type follows from the ending of their names. */
typedef enum option_kind {
    OPTION_FLAG,
    OPTION_TEXT,
    OPTION_NUMBER,
    OPTION_TIME,
    OPTION_WHOLE,
    OPTION_SETTING,
    OPTION_CSV,
    OPTION_TABLE,
    OPTION_NPZ,
    OPTION_SVG,
    OPTION_PAGE,
    OPTION_KINDS
} option_kind;

static const char *const endings[OPTION_KINDS] = {[OPTION_CSV] = ".csv",
                                                  [OPTION_TABLE] = ".csv, .npz",
                                                  [OPTION_NPZ] = ".npz",
                                                  [OPTION_SVG] = ".svg",
                                                  [OPTION_PAGE] = ".html, .htm"};

typedef struct option {
    unsigned commands;
    const char *name;
    char letter; /* short form, 0 for none */
    option_kind kind;
    size_t offset; /* of the value in cli_settings */
    const char *value, *help;
} option;

#define AT(member) offsetof(cli_settings, member)

static const option options[] = {
    {CLI_ASSEMBLE, "branches", 0, OPTION_FLAG, AT(branches), NULL, "find the other assembly modes by sampling"},
    {CLI_ASSEMBLE, "seed", 0, OPTION_WHOLE, AT(seed), "N", "other random starts for --branches"},
    {CLI_EQUILIBRIUM, "rates", 0, OPTION_TEXT, AT(equilibrium.rates), "NAME=V,..",
     "coordinates that move on at constant rates"},
    {CLI_EQUILIBRIUM, "solve-for", 0, OPTION_TEXT, AT(equilibrium.solve_for), "NAME,..",
     "parameters, or rates as qd(NAME), that are unknown"},
    {CLI_EQUILIBRIUM, "hold", 0, OPTION_TEXT, AT(equilibrium.hold), "NAME=V,..", "coordinates with known values"},
    {CLI_EQUILIBRIUM, "target", 0, OPTION_TEXT, AT(equilibrium.target), "OUTPUT=V,..",
     "prescribed values of outputs: 'position(BODY.POINT).x=0.3'"},
    {CLI_EQUILIBRIUM, "newton", 0, OPTION_FLAG, AT(newton), NULL,
     "Newton's method from the start: the nearest one, stable or not (default: descent to a stable one)"},
    {CLI_EQUILIBRIUM, "global", 0, OPTION_FLAG, AT(global), NULL, "search for others from random starts"},
    {CLI_EQUILIBRIUM, "seed", 0, OPTION_WHOLE, AT(seed), "N", "other random starts for --global"},
    {CLI_KINEMATICS, "sweep", 0, OPTION_TEXT, AT(kinematics.sweep), "NAME=A:B:N,..",
     "coordinates, drives or t that go from A to B together, in N rows (default: 361)"},
    {CLI_KINEMATICS, "hold", 0, OPTION_TEXT, AT(kinematics.hold), "NAME,..", "coordinates that stay as assembled"},
    {CLI_KINEMATICS, "release", 0, OPTION_TEXT, AT(kinematics.release), "NAME,..",
     "drives and locks of the model to leave aside"},
    {CLI_KINEMATICS, "speed", 0, OPTION_NUMBER, AT(kinematics.speed), "X",
     "of the first one driven, rad/s or m/s (default: 1)"},
    {CLI_KINEMATICS, "backend", 0, OPTION_TEXT, AT(kinematics.backend), "NAME",
     "evaluator of the equations: native machine code (default) or tape, an interpreter"},
    {CLI_KINEMATICS, "output", 'o', OPTION_CSV, AT(output), "FILE", "write the rows as CSV"},
    {CLI_KINEMATICS, "svg", 0, OPTION_SVG, AT(svg), "FILE", "draw the paths of the position outputs"},
    {CLI_CONTACT, "sweep", 0, OPTION_TEXT, AT(contact.sweep), "NAME=A:B:N,..",
     "coordinates, or parameters, that go from A to B together, in N values (default: 21)"},
    {CLI_CONTACT, "hold", 0, OPTION_TEXT, AT(contact.hold), "NAME,..", "coordinates that stay as assembled"},
    {CLI_CONTACT, "solve-for", 0, OPTION_TEXT, AT(contact.solve_for), "NAME,..",
     "coordinates that no force holds (default: those of rotating wheels; none: -)"},
    {CLI_CONTACT, "law", 0, OPTION_TEXT, AT(contact.law), "NAME",
     "forces also by this law: linear, shen, polach, tanh, fastsim, fastsim1"},
    {CLI_CONTACT, "backend", 0, OPTION_TEXT, AT(contact.backend), "NAME",
     "evaluator of the equations: native machine code (default) or tape, an interpreter"},
    {CLI_CONTACT, "output", 'o', OPTION_CSV, AT(output), "FILE", "write the table as CSV"},
    {CLI_CONTACT, "svg", 0, OPTION_SVG, AT(svg), "FILE", "draw it"},
    {CLI_INVERSE, "actuators", 0, OPTION_TEXT, AT(inverse.actuators), "NAME,..",
     "coordinates that are actuated (default: those that drives move)"},
    {CLI_INVERSE, "motion", 0, OPTION_TEXT, AT(inverse.motion), "CSV",
     "t, q.NAME, qd.NAME, qdd.NAME (default: the drives, or else the start)"},
    {CLI_INVERSE, "weights", 0, OPTION_TEXT, AT(inverse.weights), "NAME=W,..",
     "of efforts, where there are more actuators than degrees of freedom"},
    {CLI_INVERSE, "independent", 0, OPTION_TEXT, AT(run.independent), "NAME,..",
     "of the start: coordinates that are not accelerated"},
    {CLI_INVERSE, "t-end", 0, OPTION_TIME, AT(run.t_end), "T", "end of the motion, s"},
    {CLI_INVERSE, "output-step", 0, OPTION_TIME, AT(run.output_step), "T",
     "time between rows, s (default: the table's rows)"},
    {CLI_INVERSE, "backend", 0, OPTION_TEXT, AT(run.backend), "NAME",
     "evaluator of the equations: native machine code (default) or tape, an interpreter"},
    {CLI_INVERSE, "output", 'o', OPTION_CSV, AT(output), "FILE", "write a row an instant as CSV"},
    {CLI_SIMULATE, "formulation", 0, OPTION_TEXT, AT(run.formulation), "NAME", "reduced, dae or projected"},
    {CLI_SIMULATE, "form", 0, OPTION_TEXT, AT(run.form), "NAME",
     "form of the formulation's equations (reduced: integrated, newton)"},
    {CLI_SIMULATE, "integrator", 0, OPTION_TEXT, AT(run.integrator), "NAME",
     "dop853, dopri5, adams, bdf, radau5, radau9, erk, dirk or ida"},
    {CLI_SIMULATE, "linear", 0, OPTION_TEXT, AT(run.linear), "NAME",
     "linear solver of the dae formulation: auto, klu, umfpack, dense"},
    {CLI_SIMULATE | CLI_SENSITIVITY, "backend", 0, OPTION_TEXT, AT(run.backend), "NAME",
     "evaluator of the equations: native machine code (default) or tape, an interpreter"},
    {CLI_SIMULATE, "threads", 0, OPTION_WHOLE, AT(threads), "N",
     "1 to 64 threads that share each evaluation by machine code (default: 1); for large models"},
    {CLI_SIMULATE | CLI_ENSEMBLE | CLI_SENSITIVITY, "rtol", 0, OPTION_NUMBER, AT(run.rtol), "X", "relative tolerance"},
    {CLI_SIMULATE | CLI_ENSEMBLE | CLI_SENSITIVITY, "atol", 0, OPTION_NUMBER, AT(run.atol), "X",
     "absolute tolerance of an angle (default: rtol)"},
    {CLI_SIMULATE | CLI_ENSEMBLE | CLI_SENSITIVITY, "t-end", 0, OPTION_TIME, AT(run.t_end), "T", "end of the run, s"},
    {CLI_SIMULATE | CLI_SENSITIVITY, "output-step", 0, OPTION_TIME, AT(run.output_step), "T",
     "time between rows of the table, s"},
    {CLI_SIMULATE | CLI_ENSEMBLE | CLI_SENSITIVITY, "independent", 0, OPTION_TEXT, AT(run.independent), "NAME,..",
     "independent coordinates to begin with"},
    {CLI_SIMULATE, "keep-independent", 0, OPTION_FLAG, AT(keep_independent), NULL,
     "keep the given independent coordinates; fail if they become singular"},
    {CLI_SIMULATE, "change-points", 0, OPTION_TEXT, AT(run.change_points), "WORD",
     "cross: detect and cross them (default); ignore"},
    {CLI_SIMULATE | CLI_ENSEMBLE | CLI_SENSITIVITY, "max-steps", 0, OPTION_WHOLE, AT(max_steps), "N",
     "fail after N steps (default: where what is left would take 1e8)"},
    {CLI_SIMULATE | CLI_SENSITIVITY | CLI_ENSEMBLE, "no-convergence-check", 0, OPTION_FLAG, AT(no_convergence_check),
     NULL, "do not run again at another tolerance as a check"},
    {CLI_INVERSE, "no-convergence-check", 0, OPTION_FLAG, AT(no_convergence_check), NULL,
     "do not follow the table again with half its rows as a check"},
    {CLI_SIMULATE, "reference", 0, OPTION_TEXT, AT(run.reference), "CSV", "measure errors against this table"},
    {CLI_SIMULATE, "checkpoint", 0, OPTION_TEXT, AT(run.checkpoint), "FILE",
     "leave the rows there every 10 s and at the end"},
    {CLI_SIMULATE, "resume", 0, OPTION_TEXT, AT(run.resume), "FILE", "go on from a checkpoint"},
    {CLI_SIMULATE, "output", 'o', OPTION_TABLE, AT(output), "FILE", "write the trajectory: CSV, or .npz for NumPy"},
    {CLI_SIMULATE | CLI_COMPARE | CLI_SHOW, "algorithm", 0, OPTION_TEXT, AT(algorithm), "NAME",
     "of the dynamics: auto, composite (CRBA), plain, ner (recursive Newton-Euler), articulated (ABA)"},
    {CLI_ENSEMBLE, "values", 0, OPTION_TEXT, AT(values), "CSV",
     "a row an instance; columns are parameters, q.NAME and qd.NAME"},
    {CLI_ENSEMBLE, "sample", 0, OPTION_TEXT, AT(sample), "NAME=A:B,..",
     "instances at random from these ranges instead"},
    {CLI_ENSEMBLE, "instances", 0, OPTION_WHOLE, AT(instances), "N", "how many of them (default: 1000)"},
    {CLI_ENSEMBLE, "seed", 0, OPTION_WHOLE, AT(seed), "N", "other ones"},
    {CLI_ENSEMBLE, "lanes", 0, OPTION_WHOLE, AT(lanes), "N", "instances side by side, 1 to 8 (default: the best)"},
    {CLI_ENSEMBLE, "alone", 0, OPTION_FLAG, AT(alone), NULL, "no lanes: a run for each instance"},
    {CLI_ENSEMBLE, "output", 'o', OPTION_CSV, AT(output), "FILE", "write a row an instance as CSV"},
    {CLI_SENSITIVITY, "of", 0, OPTION_TEXT, AT(sensitivity.of), "WORD",
     "what is differentiated: trajectory (default), equilibrium, modes, reactions"},
    {CLI_SENSITIVITY, "parameters", 0, OPTION_TEXT, AT(sensitivity.parameters), "NAME,..",
     "by which; q.NAME and qd.NAME are start values (default: all that may vary)"},
    {CLI_SENSITIVITY, "at", 0, OPTION_TEXT, AT(sensitivity.at), "STATE",
     "of all but trajectories: equilibrium (default), 'equilibrium NAME=RATE,..', start"},
    {CLI_SENSITIVITY, "outputs", 0, OPTION_TEXT, AT(sensitivity.outputs), "OUTPUT,..",
     "q(A), position(b.P).x, a sensor's name, .. (default: those of the model)"},
    {CLI_SENSITIVITY, "method", 0, OPTION_TEXT, AT(sensitivity.method), "NAME",
     "forward: rows over time; adjoint: the end alone, for many parameters"},
    {CLI_SENSITIVITY, "integral", 0, OPTION_FLAG, AT(integral), NULL, "of the outputs integrated over time"},
    {CLI_SENSITIVITY, "integrator", 0, OPTION_TEXT, AT(run.integrator), "NAME",
     "dop853 (default), dopri5, radau5, radau9 or erk"},
    {CLI_SENSITIVITY, "output", 'o', OPTION_CSV, AT(output), "FILE", "write all rows as CSV"},
    {CLI_LINEARIZE | CLI_RESPONSE, "at", 0, OPTION_TEXT, AT(at), "STATE",
     "equilibrium (default), 'equilibrium NAME=RATE,..': a steady motion, start"},
    {CLI_LINEARIZE | CLI_RESPONSE, "inputs", 0, OPTION_TEXT, AT(inputs), "NAME,..",
     "effort(JOINT), force(BODY.POINT.x), drive(DRIVE), names of parameters"},
    {CLI_LINEARIZE | CLI_RESPONSE, "outputs", 0, OPTION_TEXT, AT(outputs), "NAME,..",
     "as the model's outputs, or a component: 'position(BODY.POINT).x'"},
    {CLI_LINEARIZE | CLI_RESPONSE, "independent", 0, OPTION_TEXT, AT(run.independent), "NAME,..",
     "independent coordinates"},
    {CLI_LINEARIZE, "output", 'o', OPTION_NPZ, AT(output), "FILE", "write matrices and names for NumPy (.npz)"},
    {CLI_RESPONSE, "frequencies", 0, OPTION_TEXT, AT(frequencies), "A:B[:N]",
     "Hz (default: decades around the model's own)"},
    {CLI_RESPONSE, "linear", 0, OPTION_FLAG, AT(linear), NULL, "in even steps (default: in even ratios)"},
    {CLI_RESPONSE, "output", 'o', OPTION_CSV, AT(output), "FILE", "write amplitudes and phases as CSV"},
    {CLI_RESPONSE, "svg", 0, OPTION_SVG, AT(svg), "FILE", "draw amplitudes and phases"},
    {CLI_MODES, "at", 0, OPTION_TEXT, AT(modes.at), "STATE",
     "equilibrium (default), 'equilibrium NAME=RATE,..': a steady motion, start"},
    {CLI_MODES, "rates", 0, OPTION_TEXT, AT(modes.rates), "NAME=V,..",
     "rates that the equilibrium keeps; one may vary: NAME=A:B:N"},
    {CLI_MODES, "independent", 0, OPTION_TEXT, AT(modes.independent), "NAME,..", "independent coordinates"},
    {CLI_MODES, "sweep", 0, OPTION_TEXT, AT(modes.sweep), "NAME=A:B:N",
     "follow the modes while a parameter, q.NAME or qd.NAME of the start varies"},
    {CLI_MODES, "orders", 0, OPTION_TEXT, AT(modes.orders), "X,..",
     "lines in the picture: frequency = X times what varies / (2 pi)"},
    {CLI_MODES, "output", 'o', OPTION_CSV, AT(output), "FILE", "write the modes, or what varied, as CSV"},
    {CLI_MODES, "svg", 0, OPTION_SVG, AT(svg), "FILE",
     "draw what varied: eigenvalues in the plane, frequencies over the value"},
    {CLI_MODES, "report", 0, OPTION_PAGE, AT(report), "FILE",
     "write one page of HTML: the mechanism moving along each mode"},
    {CLI_COMPARE, "rtol", 0, OPTION_TEXT, AT(compare.rtols), "X,..", "relative tolerances"},
    {CLI_COMPARE, "formulations", 0, OPTION_TEXT, AT(compare.formulations), "NAME,..", "formulations (default: all)"},
    {CLI_COMPARE, "forms", 0, OPTION_TEXT, AT(compare.forms), "NAME,..", "forms (default: the standard ones)"},
    {CLI_COMPARE, "integrators", 0, OPTION_TEXT, AT(compare.integrators), "NAME,..",
     "integrators (default: the standard ones; for a stiff model all implicit ones too)"},
    {CLI_COMPARE, "reference", 0, OPTION_TEXT, AT(compare.reference), "CSV",
     "reference (default: made from several formulations and integrators)"},
    {CLI_COMPARE, "t-end", 0, OPTION_TIME, AT(compare.t_end), "T", "end of every run, s"},
    {CLI_COMPARE, "budget", 0, OPTION_NUMBER, AT(compare.budget_s), "S",
     "processor time for all runs together, s (default: 60)"},
    {CLI_COMPARE, "csv", 0, OPTION_CSV, AT(csv), "FILE", "write the table as CSV"},
    {CLI_COMPARE, "report", 0, OPTION_PAGE, AT(report), "FILE",
     "write one page of HTML: verdict, plots, the mechanism moving"},
    {CLI_SHOW, "model", 0, OPTION_FLAG, AT(show_model), NULL, "the model as Kempe understood it"},
    {CLI_SHOW, "equations", 0, OPTION_FLAG, AT(show_equations), NULL, "M, C, h, J, jdqd as assignments"},
    {CLI_SHOW, "program", 0, OPTION_FLAG, AT(show_program), NULL, "the staged program of the reduced formulation"},
    {CLI_SHOW, "stats", 0, OPTION_FLAG, AT(show_stats), NULL,
     "operation counts; with --equations also after each pass"},
    {CLI_GENERATE, "count", 0, OPTION_FLAG, AT(count), NULL,
     "operations by set, each derived alone, and of all as one"},
    {CLI_GENERATE, "sets", 0, OPTION_TEXT, AT(generation.sets), "NAME,..",
     "M_C, invdyn, h_J, jdqd (default: these four), M, C, qdd, h, J, h_t, tangents, R, R_tangents, invdyn_q, "
     "invdyn_qd, "
     "R_q; + for one program"},
    {CLI_GENERATE, "scheme", 0, OPTION_TEXT, AT(generation.scheme), "NAME", "how M is made: composite (default), ner"},
    {CLI_GENERATE, "keep-parameters", 0, OPTION_FLAG, AT(keep_parameters), NULL,
     "every number that is not zero stays a symbol"},
    {CLI_GENERATE, "body-inputs", 0, OPTION_FLAG, AT(body_inputs), NULL,
     "three forces and three torques on every body as inputs"},
    {CLI_GENERATE, "no-inputs", 0, OPTION_TEXT, AT(generation.no_inputs), "BODY,..", "bodies that have none of them"},
    {CLI_GENERATE, "drives", 0, OPTION_FLAG, AT(drives), NULL, "the closures have rows of drives and locks too"},
    {CLI_GENERATE, "optimize", 0, OPTION_FLAG, AT(optimize), NULL,
     "fewest operations at run time, joint by joint: slower"},
    {CLI_GENERATE, "lang", 0, OPTION_TEXT, AT(generation.language), "NAME",
     "write them in a language: c, octave, python"},
    {CLI_GENERATE, "form", 0, OPTION_TEXT, AT(generation.form), "NAME",
     "names of variables: legible (default), compact"},
    {CLI_GENERATE, "vectorised", 0, OPTION_FLAG, AT(vectorised), NULL,
     "array languages: one statement for all that can be done at once"},
    {CLI_GENERATE, "output", 'o', OPTION_TEXT, AT(output), "DIR", "where to write the files (default: here)"},
    {CLI_ALL & ~(CLI_NEW | CLI_SHOW | CLI_GENERATE | CLI_CONTACT), "closure-tolerance", 0, OPTION_TEXT,
     AT(closure_tolerance), "X", "m that closures which say what others say may stay open by, as rounding; 0: none"},
    {CLI_ALL & ~CLI_NEW, "set", 0, OPTION_SETTING, 0, "NAME=VALUE", "another value of a parameter; may be given again"},
    {CLI_ALL, "json", 0, OPTION_TEXT, AT(json), "PATH|-", "write one JSON object; - for stdout, instead of text"},
    {CLI_ALL, "help", 'h', OPTION_FLAG, AT(help), NULL, "this text"},
};

enum { OPTION_COUNT = sizeof options / sizeof *options, WORD_MAX = 64 };

/* -- error messages ---------------------------------------------------------------------------------- */

static char last_complaint[512];

void cli_complain(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vsnprintf(last_complaint, sizeof last_complaint, format, list);
    va_end(list);
    fprintf(stderr, "kempe: %s\n", last_complaint);
}

const char *cli_complaint(void)
{
    return last_complaint;
}

/* -- names that are nearly right --------------------------------------------------------------------- */

/* Levenshtein distance, one row at a time. Words longer than WORD_MAX are never near. */
static size_t distance(const char *a, const char *b)
{
    size_t row[WORD_MAX + 1], n = strlen(b);
    if (strlen(a) > WORD_MAX || n > WORD_MAX)
        return WORD_MAX;
    for (size_t j = 0; j <= n; j++)
        row[j] = j;
    for (size_t i = 0; a[i]; i++) {
        size_t diagonal = row[0];
        row[0] = i + 1;
        for (size_t j = 0; j < n; j++) {
            size_t change = diagonal + (a[i] != b[j]), drop = row[j + 1] + 1, insert = row[j] + 1;
            diagonal = row[j + 1];
            size_t best = change < drop ? change : drop;
            row[j + 1] = best < insert ? best : insert;
        }
    }
    return row[n];
}

const char *cli_nearest(const char *word, const char *const *words)
{
    const char *best = NULL;
    size_t least = strlen(word) / 2 + 1; /* more than half of the word wrong is another word */
    for (; *words; words++) {
        size_t d = distance(word, *words);
        if (d < least) {
            least = d;
            best = *words;
        }
    }
    return best;
}

static bool complain_unknown(unsigned command, const char *command_name, const char *word)
{
    const char *names[OPTION_COUNT + 1];
    int count = 0;
    for (int k = 0; k < OPTION_COUNT; k++)
        if (options[k].commands & command)
            names[count++] = options[k].name;
    names[count] = NULL;
    const char *near = cli_nearest(word + strspn(word, "-"), names);
    if (near)
        cli_complain("unknown option '%s', did you mean '--%s'?", word, near);
    else
        cli_complain("unknown option '%s'; 'kempe %s --help' lists the options", word, command_name);
    return false;
}

static const option *find(unsigned command, const char *word, size_t length)
{
    for (const option *o = options; o < options + OPTION_COUNT; o++) {
        if (!(o->commands & command))
            continue;
        if (length == 2 && o->letter && word[1] == o->letter)
            return o;
        if (length > 2 && strlen(o->name) == length - 2 && strncmp(word, "--", 2) == 0 &&
            strncmp(word + 2, o->name, length - 2) == 0)
            return o;
    }
    return NULL;
}

static bool store_number(const option *o, const char *text, double *value)
{
    char *end;
    double x = strtod(text, &end);
    if (end == text || *end || !isfinite(x) || x <= 0) {
        cli_complain("--%s needs a positive number, not '%s'", o->name, text);
        return false;
    }
    if (o->kind == OPTION_WHOLE && (x > 1e15 || x != (double)(long long)x)) {
        cli_complain("--%s needs a whole number, not '%s'", o->name, text);
        return false;
    }
    *value = x;
    return true;
}

/* "3", "20 ms" */
static bool store_time(const option *o, const char *text, double *value)
{
    kempe_context *context = kempe_context_new();
    double x = 0;
    bool good = context && kempe_number_read(context, text, "s", &x) == KEMPE_OK && x > 0;
    if (!context)
        cli_complain("out of memory");
    else if (!good)
        cli_complain("--%s needs a positive time in s, as 3 or '20 ms', not '%s'", o->name, text);
    kempe_context_free(context);
    if (good)
        *value = x;
    return good;
}

/* A name without an ending is taken as the first kind of file, a device by it. */
static bool has_ending(const option *o, const char *path)
{
    const char *slash = strrchr(path, '/'), *dot = strrchr(slash ? slash : path, '.'), *at = endings[o->kind];
    while (dot && at && *at) {
        size_t length = strcspn(at, ",");
        if (strlen(dot) == length && strncmp(dot, at, length) == 0)
            return true;
        at += length + (at[length] ? 2 : 0);
    }
    return !dot || !endings[o->kind];
}

/* Splits NAME=VALUE at the sign, in place. */
static bool store_setting(char *text, cli_settings *settings)
{
    size_t length = strcspn(text, "=");
    if (length == 0 || !text[length] || !text[length + 1]) {
        cli_complain("--set needs NAME=VALUE, not '%s'", text);
        return false;
    }
    if (settings->set_count == CLI_MOST_SETS) {
        cli_complain("--set: at most %d parameters can be set", CLI_MOST_SETS);
        return false;
    }
    text[length] = '\0';
    settings->sets[settings->set_count++] = (kempe_setting){text, text + length + 1};
    return true;
}

static bool store(const option *o, char *text, cli_settings *settings)
{
    char *place = (char *)settings + o->offset;
    if (o->kind == OPTION_NUMBER || o->kind == OPTION_WHOLE)
        return store_number(o, text, (double *)(void *)place);
    if (o->kind == OPTION_TIME)
        return store_time(o, text, (double *)(void *)place);
    if (o->kind == OPTION_SETTING)
        return store_setting(text, settings);
    if (!has_ending(o, text)) {
        cli_complain("--%s writes files of these kinds: %s, not '%s'", o->name, endings[o->kind], text);
        return false;
    }
    *(const char **)(void *)place = text;
    return true;
}

/* Reads one option at words[0]; returns the number of words consumed, 0 after an error message. */
static int read_option(unsigned command, const char *name, int count, char **words, cli_settings *settings)
{
    size_t length = strcspn(words[0], "=");
    const option *o = find(command, words[0], length);
    if (!o)
        return complain_unknown(command, name, words[0]);
    char *attached = words[0][length] ? words[0] + length + 1 : NULL;
    if (o->kind == OPTION_FLAG) {
        if (attached) {
            cli_complain("--%s takes no value", o->name);
            return 0;
        }
        *(bool *)((char *)settings + o->offset) = true;
        return 1;
    }
    if (!attached && count < 2) {
        cli_complain("--%s needs a value: %s", o->name, o->value);
        return 0;
    }
    return store(o, attached ? attached : words[1], settings) ? 2 - (attached != NULL) : 0;
}

static bool read_file_name(const char *word, cli_settings *settings)
{
    if (settings->file) {
        cli_complain("one model file at a time: '%s' and '%s' are given", settings->file, word);
        return false;
    }
    settings->file = word;
    return true;
}

const char *cli_json_word(int count, char **words)
{
    const char *path = NULL;
    for (int k = 0; k < count && strcmp(words[k], "--") != 0; k++)
        if (strcmp(words[k], "--json") == 0 && k + 1 < count)
            path = words[++k];
        else if (strncmp(words[k], "--json=", 7) == 0)
            path = words[k] + 7;
    return path;
}

bool cli_options_read(unsigned command, const char *command_name, int count, char **words, cli_settings *settings)
{
    *settings = (cli_settings){.run = kempe_run_options_default(), .compare = kempe_compare_options_default()};
    bool names_only = false;
    for (int k = 0; k < count;) {
        if (!names_only && strcmp(words[k], "--") == 0) {
            names_only = true;
            k++;
        } else if (!names_only && words[k][0] == '-' && words[k][1]) {
            int taken = read_option(command, command_name, count - k, words + k, settings);
            if (taken == 0)
                return false;
            k += taken;
        } else if (!read_file_name(words[k++], settings)) {
            return false;
        }
    }
    if (!settings->file && !settings->help) {
        cli_complain("which model? 'kempe %s %s'", command_name, command == CLI_NEW ? "NAME" : "FILE");
        return false;
    }
    return true;
}

void cli_options_print(unsigned command, FILE *out)
{
    for (const option *o = options; o < options + OPTION_COUNT; o++) {
        if (!(o->commands & command))
            continue;
        char left[40];
        snprintf(left, sizeof left, "--%s%s%s", o->name, o->value ? " " : "", o->value ? o->value : "");
        if (o->letter)
            fprintf(out, "  -%c, %-25s%s\n", o->letter, left, o->help);
        else
            fprintf(out, "      %-25s%s\n", left, o->help);
    }
}
