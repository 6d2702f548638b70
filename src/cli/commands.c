/* SPDX-License-Identifier: BSD-3-Clause */
/* The commands, in the order of the help, and their studies. In a build without a wing of the library (KEMPE_RAIL and
 * others) its commands say that it is missing. */
#include "command.h"

#include <kempe/check.h>
#include <kempe/ensemble.h>
#include <kempe/linearize.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* -- studies --------------------------------------------------------------------------------------------- */

/* Each is the functions of its result and the files that options ask for; cli_run_study runs any of them. */

#define AT(member) offsetof(cli_settings, member)

/* A study whose result is a `type` of the library. `call` makes *result for the job j with the settings s. Then follow
 * the function of its table, or NULL, and its files: the option that has the path, and the function that writes there.
 */
#define STUDY(name, type, call, ...)                                                                                   \
    static kempe_status name##_make(const cli_job *j, const cli_settings *s, type **result)                            \
    {                                                                                                                  \
        (void)j, (void)s;                                                                                              \
        return call;                                                                                                   \
    }                                                                                                                  \
    static kempe_status name##_compute(const cli_job *j, void **object)                                                \
    {                                                                                                                  \
        type *result = NULL;                                                                                           \
        kempe_status status = name##_make(j, j->settings, &result);                                                    \
        *object = result;                                                                                              \
        return status;                                                                                                 \
    }                                                                                                                  \
    static kempe_status name##_print(const cli_job *j, const void *object, kempe_format format, char **text)           \
    {                                                                                                                  \
        (void)j;                                                                                                       \
        return type##_print(object, format, text);                                                                     \
    }                                                                                                                  \
    static void name##_free(void *object)                                                                              \
    {                                                                                                                  \
        type##_free(object);                                                                                           \
    }                                                                                                                  \
    static const cli_study name##_study = {                                                                            \
        .compute = name##_compute, .print = name##_print, .free = name##_free, __VA_ARGS__};

/* The function of the library that writes a result to a file, for results of any type. */
#define WRITER(function)                                                                                               \
    static kempe_status any_##function(const cli_job *j, void *object, const char *path)                               \
    {                                                                                                                  \
        (void)j;                                                                                                       \
        return function(object, path);                                                                                 \
    }

/* The table of a result by its name. */
#define TABLE(type, name)                                                                                              \
    static kempe_status type##_rows(const cli_job *j, const void *object, bool drawn, kempe_table **table)             \
    {                                                                                                                  \
        (void)j, (void)drawn;                                                                                          \
        return type##_table(object, name, table);                                                                      \
    }

/* Files that `--report` asks for: none in a build without pages, where cli_run_study refuses the option. */
#ifdef KEMPE_REPORT
#define REPORT(function) AT(report), any_##function
#define REPORT_WRITER    WRITER
#else
#define REPORT(function) 0, NULL
#define REPORT_WRITER(function)
#endif

/* All rows of a run; a picture has the outputs that --x and --y name, also those that the model does not list. */
static kempe_status kempe_trajectory_rows(const cli_job *j, const void *trajectory, bool drawn, kempe_table **table)
{
    const cli_settings *s = j->settings;
    bool by_time = !s->x || strcmp(s->x, "t") == 0;
    if (!drawn || !s->y)
        return kempe_trajectory_table(trajectory, "rows", table);
    size_t size = strlen(s->y) + (by_time ? 0 : strlen(s->x)) + 2;
    char *names = malloc(size);
    if (!names)
        return KEMPE_E_MEMORY;
    snprintf(names, size, "%s%s%s", s->y, by_time ? "" : ",", by_time ? "" : s->x);
    kempe_status status = kempe_trajectory_outputs(trajectory, names, table);
    free(names);
    return status;
}

TABLE(kempe_comparison, "runs")
REPORT_WRITER(kempe_comparison_write_report)
REPORT_WRITER(kempe_trajectory_write_report)
REPORT_WRITER(kempe_assembly_write_report)

/* With the running safety of vehicles. */
static kempe_status simulate_judged(const kempe_system *system, const kempe_run_options *run, kempe_trajectory **result)
{
    kempe_run_options judged = *run;
    judged.judge_safety = 1;
    return kempe_simulate(system, &judged, result);
}

STUDY(check, kempe_check, kempe_check_new(j->system, result), .table = NULL)
STUDY(assembly, kempe_assembly, kempe_assembly_new(j->system, result), .table = NULL,
      .files = {{REPORT(kempe_assembly_write_report)}})
STUDY(branches, kempe_branches, kempe_branches_new(j->system, s->seed, result), .table = NULL)
STUDY(simulate, kempe_trajectory, simulate_judged(j->system, &s->run, result), .table = kempe_trajectory_rows,
      .files = {{REPORT(kempe_trajectory_write_report)}})
STUDY(compare, kempe_comparison, kempe_comparison_new(j->system, &s->compare, result), .table = kempe_comparison_rows,
      .files = {{REPORT(kempe_comparison_write_report)}})

/* -- commands with steps of their own ---------------------------------------------------------------- */

static kempe_status run_assemble(const cli_job *j)
{
    return cli_run_study(j, j->settings->branches ? &branches_study : &assembly_study);
}

static kempe_status print_view(const cli_job *j, const void *object, kempe_format format, char **text)
{
    const cli_settings *s = j->settings;
    (void)object;
    if (s->show_model)
        return kempe_model_print(j->model, format, text);
    if (s->show_as) {
#ifdef KEMPE_EXCHANGE
        return kempe_model_export(j->model, s->show_as, text);
#else
        cli_lacks_wing("EXCHANGE");
        return KEMPE_E_ARGUMENT;
#endif
    }
    kempe_view view = s->show_program      ? KEMPE_VIEW_PROGRAM
                      : !s->show_equations ? KEMPE_VIEW_STATS
                      : s->show_stats      ? KEMPE_VIEW_PASSES
                                           : KEMPE_VIEW_EQUATIONS;
    return kempe_system_print(j->system, view, format, text);
}

static kempe_status run_show(const cli_job *j)
{
    return cli_worse(KEMPE_OK, cli_report(j, print_view, NULL));
}

/* The commands of a wing have its name, and their study or action where it is in the build. */

/* -- analyses -------------------------------------------------------------------------------------------- */

#ifdef KEMPE_ANALYSES
TABLE(kempe_kinematics, "rows")
WRITER(kempe_kinematics_write_picture)
TABLE(kempe_inverse, "rows")
WRITER(kempe_linearization_write)
TABLE(kempe_modes, "rows")
WRITER(kempe_modes_write_picture)
TABLE(kempe_limit_cycles, "rows")
WRITER(kempe_limit_cycles_write_picture)
TABLE(kempe_response, "rows")
TABLE(kempe_comfort, "windows")
WRITER(kempe_response_write_picture)
TABLE(kempe_sensitivity, "rows")
REPORT_WRITER(kempe_modes_write_report)
REPORT_WRITER(kempe_limit_cycles_write_report)
REPORT_WRITER(kempe_equilibrium_write_report)
REPORT_WRITER(kempe_response_write_report)
REPORT_WRITER(kempe_inverse_write_report)
REPORT_WRITER(kempe_kinematics_write_report)
STUDY(kinematics, kempe_kinematics, kempe_kinematics_new(j->system, &s->kinematics, result),
      .table = kempe_kinematics_rows,
      .files = {{AT(svg), any_kempe_kinematics_write_picture}, {REPORT(kempe_kinematics_write_report)}})
STUDY(inverse, kempe_inverse, kempe_inverse_new(j->system, &s->inverse, result), .table = kempe_inverse_rows,
      .files = {{REPORT(kempe_inverse_write_report)}})
STUDY(modes, kempe_modes, kempe_modes_new(j->system, &s->modes, result), .table = kempe_modes_rows,
      .files = {{AT(svg), any_kempe_modes_write_picture}, {REPORT(kempe_modes_write_report)}})
STUDY(response, kempe_response, kempe_response_new(j->system, &s->response, result), .table = kempe_response_rows,
      .files = {{AT(svg), any_kempe_response_write_picture}, {REPORT(kempe_response_write_report)}})

/* Options of state spaces are those that the response has, too. */
static kempe_status linearize_about(const cli_job *j, kempe_linearization **result)
{
    const kempe_response_options *s = &j->settings->response;
    const kempe_linearize_options options = {
        .at = s->at, .inputs = s->inputs, .outputs = s->outputs, .independent = s->independent, .backend = s->backend};
    return kempe_linearization_new(j->system, &options, result);
}

STUDY(cycles, kempe_limit_cycles, kempe_limit_cycles_new(j->system, &s->cycles, result),
      .table = kempe_limit_cycles_rows,
      .files = {{AT(svg), any_kempe_limit_cycles_write_picture}, {REPORT(kempe_limit_cycles_write_report)}})
STUDY(equilibrium, kempe_equilibrium, kempe_equilibrium_new(j->system, &s->equilibrium, result), .table = NULL,
      .files = {{REPORT(kempe_equilibrium_write_report)}})
STUDY(linearize, kempe_linearization, linearize_about(j, result), .table = NULL,
      .files = {{AT(output), any_kempe_linearization_write}})
STUDY(comfort, kempe_comfort, kempe_comfort_new(j->system, &s->comfort, result), .table = kempe_comfort_rows)
STUDY(sensitivity, kempe_sensitivity, kempe_sensitivity_new(j->model, &s->sensitivity, result),
      .table = kempe_sensitivity_rows)

#define ANALYSES(action) .wing = "ANALYSES", action
#else
#define ANALYSES(action) .wing = "ANALYSES"
#endif

/* -- wheels on rails ------------------------------------------------------------------------------------- */

#ifdef KEMPE_RAIL
/* The conicities, where they are requested. */
static kempe_status kempe_contacts_rows(const cli_job *j, const void *contacts, bool drawn, kempe_table **table)
{
    (void)drawn;
    return kempe_contacts_table(contacts, j->settings->contact.conicity ? "conicity" : "rows", table);
}

WRITER(kempe_contacts_write_picture)

STUDY(contact, kempe_contacts, kempe_contacts_new(j->system, &s->contact, result), .table = kempe_contacts_rows,
      .files = {{AT(svg), any_kempe_contacts_write_picture}})

#define RAIL(action) .wing = "RAIL", action
#else
#define RAIL(action) .wing = "RAIL"
#endif

/* -- other programs -------------------------------------------------------------------------------------- */

#ifdef KEMPE_EXCHANGE
WRITER(kempe_fmu_export_write)

STUDY(count, kempe_count, kempe_count_new(j->model, &s->generation, result), .table = NULL)

STUDY(code, kempe_code, kempe_code_new(j->model, &s->generation, result), .table = NULL)

/* Writes the files, then the report. */
static kempe_status run_generate(const cli_job *j)
{
    const char *folder = j->settings->output ? j->settings->output : ".";
    void *result = NULL;
    if (j->settings->count)
        return cli_run_study(j, &count_study);
    kempe_status status = code_study.compute(j, &result);
    cli_report_failure(j, status, result != NULL);
    if (result) {
        kempe_status written = cli_report_written(j, kempe_code_write(result, folder));
        status = cli_worse(status, written == KEMPE_OK ? cli_report(j, code_study.print, result) : written);
    }
    code_study.free(result);
    return status;
}

/* Beside the command where it was built, otherwise where it was installed. */
static char *find_library(void)
{
    char *built = cli_from_command(CLI_UNITS);
    if (built && access(built, R_OK) == 0)
        return built;
    free(built);
    return cli_from_command(CLI_TO_LIBRARIES "/" CLI_UNITS);
}

/* With the library of units that belongs to this command. */
static kempe_status export_unit(const kempe_model *model, const cli_settings *s, kempe_fmu_export **made)
{
    kempe_fmu_options options = s->fmu;
    char *file = s->unit_on_library ? find_library() : NULL;
    options.unit_file = file;
    kempe_status status = kempe_fmu_export_new(model, &options, made);
    free(file);
    return status;
}

STUDY(fmu, kempe_fmu_export, export_unit(j->model, s, result), .files = {{AT(output), any_kempe_fmu_export_write}})

#define EXCHANGE(action) .wing = "EXCHANGE", action
#else
#define EXCHANGE(action) .wing = "EXCHANGE"
#endif

/* -- ensembles ------------------------------------------------------------------------------------------- */

#ifdef KEMPE_ENSEMBLE
TABLE(kempe_ensemble_result, "instances")
REPORT_WRITER(kempe_fit_write_report)
REPORT_WRITER(kempe_optimum_write_report)

/* The estimates; a picture has the fitted motion and the data. */
static kempe_status kempe_fit_rows(const cli_job *j, const void *fit, bool drawn, kempe_table **table)
{
    (void)j;
    return kempe_fit_table(fit, drawn ? "first" : "parameters", table);
}

STUDY(fit, kempe_fit, kempe_fit_new(j->model, &s->fit, result), .table = kempe_fit_rows,
      .files = {{REPORT(kempe_fit_write_report)}})

/* The parameters; a picture has the course of the search. */
static kempe_status kempe_optimum_rows(const cli_job *j, const void *optimum, bool drawn, kempe_table **table)
{
    (void)j;
    return kempe_optimum_table(optimum, drawn ? "history" : "parameters", table);
}

STUDY(optimize, kempe_optimum, kempe_optimum_new(j->model, &s->optimize, result), .table = kempe_optimum_rows,
      .files = {{REPORT(kempe_optimum_write_report)}})

/* An ensemble, with the batch of its instances, or the folder into which it runs. */
typedef struct instances {
    kempe_values *values;
    kempe_ensemble *ensemble;
    kempe_ensemble_result *batch;
    kempe_folder *folder;
} instances;

static void instances_free(void *object)
{
    instances *i = object;
    if (!i)
        return;
    kempe_folder_free(i->folder);
    kempe_ensemble_result_free(i->batch);
    kempe_ensemble_free(i->ensemble);
    kempe_values_free(i->values);
    free(i);
}

static kempe_status instances_compute(const cli_job *j, void **object)
{
    const cli_settings *s = j->settings;
    const kempe_ensemble_options measured = {.size = sizeof measured, .quantities = s->quantities, .limits = s->limits};
    const int lanes = s->alone ? -1 : s->lanes;
    instances *i = calloc(1, sizeof *i);
    kempe_status status = !i          ? KEMPE_E_MEMORY
                          : s->values ? kempe_values_read(j->model, s->values, &i->values)
                                      : kempe_values_sample(j->model, &s->sample, &i->values);
    if (status == KEMPE_OK)
        status = kempe_ensemble_new_with(j->model, i->values, &measured, &i->ensemble);
    if (status == KEMPE_OK && s->out) {
        status = kempe_ensemble_run_folder(i->ensemble, &s->run, lanes, s->out, &s->folder, &i->folder);
        status = status == KEMPE_E_IO ? KEMPE_E_FAILED : status; /* an output that cannot be written */
    } else if (status == KEMPE_OK) {
        status = kempe_ensemble_run(i->ensemble, &s->run, lanes, &i->batch);
    }
    if (i && (i->batch || i->folder))
        *object = i;
    else
        instances_free(i);
    return status;
}

static kempe_status instances_print(const cli_job *j, const void *object, kempe_format format, char **text)
{
    const instances *i = object;
    (void)j;
    return i->folder ? kempe_folder_print(i->folder, format, text)
                     : kempe_ensemble_result_print(i->batch, format, text);
}

static kempe_status instances_table(const cli_job *j, const void *object, bool drawn, kempe_table **table)
{
    const instances *i = object;
    return kempe_ensemble_result_rows(j, i->batch, drawn, table);
}

#ifdef KEMPE_REPORT
static kempe_status any_instances_report(const cli_job *j, void *object, const char *path)
{
    const instances *i = object;
    (void)j;
    return kempe_ensemble_result_write_report(i->batch, path);
}
#endif

static kempe_status instances_history(const cli_job *j, void *object, const char *path)
{
    const instances *i = object;
    kempe_table *table = NULL;
    kempe_status status = kempe_ensemble_history(i->ensemble, &j->settings->run, j->settings->folder.history, &table);
    if (status == KEMPE_OK && j->settings->units)
        kempe_table_name_units(table);
    if (status == KEMPE_OK)
        status = kempe_table_write(table, path);
    kempe_table_free(table);
    return status;
}

static const cli_study ensemble_study = {
    .compute = instances_compute,
    .print = instances_print,
    .free = instances_free,
    .table = instances_table,
    .files = {{REPORT(instances_report)}, {AT(history_output), instances_history}}};

static kempe_status print_folder(const cli_job *j, const void *object, kempe_format format, char **text)
{
    (void)j;
    return kempe_folder_print(object, format, text);
}

/* A part that is damaged, and an output that cannot be written, are no wrong input. */
static kempe_status gathered(kempe_status status)
{
    return status == KEMPE_E_IO || status == KEMPE_E_INPUT ? KEMPE_E_FAILED : status;
}

/* A doubt about instances stops no output. */
static bool is_complete(kempe_status status)
{
    return status == KEMPE_OK || status == KEMPE_UNTRUSTED;
}

/* Checks the parts, and writes the tables and the page that are requested. */
static kempe_status run_gather(const cli_job *j)
{
    const cli_settings *s = j->settings;
    kempe_status status = s->report ? cli_check_report(j) : KEMPE_OK;
#ifdef KEMPE_REPORT
    if (status == KEMPE_OK && s->report)
        status = kempe_folder_write_report(j->folder, j->model, s->report);
#endif
    bool wrong = status == KEMPE_E_INPUT;
    if (is_complete(status) && s->output)
        status = cli_worse(status, gathered(kempe_folder_write(j->folder, s->output, s->units)));
    else if (status == KEMPE_OK && !s->report)
        status = gathered(kempe_folder_check(j->folder));
    if (is_complete(status) && s->history_output)
        status = cli_worse(status, gathered(kempe_folder_write_history(j->folder, s->history_output, s->units)));
    bool ended = status != KEMPE_STOPPED && !wrong;
    cli_report_failure(j, status, ended);
    return ended ? cli_worse(status, cli_report(j, print_folder, j->folder)) : status;
}

#define ENSEMBLE(action) .wing = "ENSEMBLE", action
#else
#define ENSEMBLE(action) .wing = "ENSEMBLE"
#endif

/* -- missing and contradicting options --------------------------------------------------------------- */

const char *cli_lacking(unsigned command, const cli_settings *s)
{
    const bool swept = s->modes.sweep || (s->modes.rates && strchr(s->modes.rates, ':'));
    /* `show` prints one view at a time; equations and stats together are the passes. */
    const int views = s->show_model + s->show_equations + s->show_program + s->show_stats + !!s->show_as;
    const bool passes = s->show_equations && s->show_stats && views == 2;
    const struct {
        unsigned command;
        bool lacks;
        const char *sentence;
    } rows[] = {
        {CLI_ALL, !s->plot && (s->x || s->y), "--x and --y choose what --plot draws: give --plot FILE.svg"},
        {CLI_KINEMATICS, !s->kinematics.sweep, "the swept coordinate is missing: give --sweep NAME=A:B"},
        {CLI_CONTACT, !s->contact.sweep,
         "the sweep is missing: --sweep NAME=A:B:N of a coordinate or parameter, for example the lateral position of "
         "the wheels, --sweep 'y=0:-6 mm:13'; 'kempe check FILE' lists the coordinates"},
        {CLI_MODES, s->svg && !swept, "--svg draws a sweep: give --sweep NAME=A:B:N or --rates NAME=A:B:N"},
        {CLI_CYCLES, !s->cycles.sweep, "the parameter and its range are missing: give --sweep NAME=A:B:N"},
        {CLI_ENSEMBLE, !s->values == !s->sample.ranges, "ensemble needs either --values FILE or --sample NAME=A:B,.."},
        {CLI_ENSEMBLE, !s->out && (s->folder.resume || s->folder.shard || s->folder.chunk),
         "--resume, --shard and --chunk belong to a folder: give --out RUN.kempe"},
        {CLI_ENSEMBLE, s->out && (s->output || s->plot || s->report),
         "--out writes parts, not one table: 'kempe gather FOLDER' writes one with --output, a page with --report"},
        {CLI_ENSEMBLE, s->out && s->history_output,
         "--out has the histories in its folder: 'kempe gather FOLDER --history-output FILE' writes one table"},
        {CLI_ENSEMBLE, s->folder.history && !s->out && !s->history_output,
         "--history needs a place for the rows: --history-output FILE, or a folder, --out RUN.kempe"},
        {CLI_ENSEMBLE, !s->folder.history && (s->history_output || s->run.output_step > 0),
         "--history-output and --output-step belong to chosen instances: give --history K,A:B,.."},
        {CLI_GATHER, !s->report && (s->model || s->set_count > 0),
         "--model, --set and --input belong to a page: give --report FILE.html"},
        {CLI_FIT, !s->fit.data, "the data is missing: kempe fit MODEL DATA.csv --parameter NAME"},
        {CLI_FIT, !s->fitted[0], "fit needs --parameter NAME[:LOW:HIGH]; 'kempe show --model FILE' lists parameters"},
        {CLI_OPTIMIZE, !s->optimize.minimize == !s->optimize.maximize,
         "optimize needs either --minimize QUANTITY or --maximize QUANTITY"},
        {CLI_OPTIMIZE, !s->fitted[0], "optimize needs --parameter NAME:LOW:HIGH"},
        {CLI_SIMULATE, !s->from != !s->instance, "--from FOLDER and --instance K belong together"},
        {CLI_GENERATE, !s->count && !s->generation.language, "generate needs --lang NAME, or --count"},
        {CLI_FMU, !s->output, "the file of the unit is missing: --output NAME.fmu"},
        {CLI_SHOW, views != 1 && !passes, "show needs one of --model, --as, --equations, --program, --stats"},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        if (rows[k].command & command && rows[k].lacks)
            return rows[k].sentence;
    return NULL;
}

/* -- the commands ------------------------------------------------------------------------------------ */

const cli_command cli_commands[] = {
    {CLI_NEW, "new", "write a first model, NAME.yaml: a four-bar linkage with comments",
     "  kempe new four_bar\n"
     "  kempe check four_bar.yaml\n"
     "  kempe simulate four_bar.yaml\n",
     .usage = "NAME [options]", .without_model = true, .run = cli_new},
    {CLI_CHECK, "check", "model diagnostics: degrees of freedom, redundant closures, independent coordinates",
     "  kempe check examples/andrews/andrews.yaml\n", .study = &check_study},
    {CLI_ASSEMBLE, "assemble", "assembly: close the loops, starting from the model's start values; assembly modes",
     "  kempe assemble examples/four_bar/four_bar.yaml --json start.json\n"
     "  kempe assemble examples/four_bar/four_bar.yaml --branches\n",
     .run = run_assemble},
    {CLI_VIEW, "view", "show a page of results, or a model's assembled start, in a browser",
     "  kempe view four_bar.html\n"
     "  kempe view examples/stewart/stewart.yaml\n",
     .opens_pages = true, .dynamics = "plain", .run = cli_view},
    {CLI_KINEMATICS, "kinematics", "position analysis: sweep coordinates; velocities, accelerations, dead centres",
     "  kempe kinematics examples/four_bar/four_bar.yaml --sweep \"A=0 deg:360 deg\" -o turn.csv\n"
     "  kempe kinematics examples/driven_slider_crank/driven_slider_crank.yaml --sweep t=0:1:101\n"
     "  kempe kinematics examples/chebyshev/chebyshev.yaml --sweep \"crank=0 deg:360 deg\" --svg paths.svg\n",
     .usage = "FILE --sweep NAME=A:B[,NAME=A:B..] [options]", .dynamics = "plain",
     ANALYSES(.study = &kinematics_study)},
    {CLI_EQUILIBRIUM, "equilibrium", "static or steady-state equilibrium and its stability",
     "  kempe equilibrium examples/four_bar/four_bar.yaml --global\n"
     "  kempe equilibrium examples/governor/governor.yaml --rates shaft=5.5\n"
     "  kempe equilibrium examples/governor/governor.yaml --rates shaft=5.5 --solve-for 'qd(shaft)' --hold "
     "slider=0.6\n",
     .dynamics = "plain", ANALYSES(.study = &equilibrium_study)},
    {CLI_CONTACT, "contact", "wheel-rail contact table: contact positions, creepages and forces over a sweep",
     "  kempe contact examples/manchester/manchester.yaml --sweep \"shift=0:10 mm:21\"\n"
     "  kempe contact examples/manchester/manchester.yaml --sweep \"shift=0:10 mm:21\" --law fastsim --svg "
     "contact.svg\n"
     "  kempe contact examples/conicity/conicity.yaml --sweep \"shift=-9 mm:9 mm:181\" --conicity \"1 mm:7 mm:13\"\n",
     .usage = "FILE --sweep NAME=A:B:N[,NAME=A:B..] [options]", .dynamics = "plain", RAIL(.study = &contact_study)},
    {CLI_SIMULATE, "simulate", "simulate with one formulation; accuracy checks of the result",
     "  kempe simulate examples/andrews/andrews.yaml -o andrews.csv\n"
     "  kempe simulate examples/andrews/andrews.yaml --report andrews.html\n"
     "  kempe simulate examples/andrews/andrews.yaml --plot andrews.svg --y 'q(beta), force(spring)'\n"
     "  kempe simulate examples/slider_crank/slider_crank.yaml --rtol 1e-8 --t-end 2 --output-step 0.01\n"
     "  kempe simulate examples/andrews/andrews.yaml --formulation dae --json -\n"
     "  kempe simulate --from bars.kempe --instance 17 --report bar17.html\n",
     .study = &simulate_study},
    {CLI_INVERSE, "inverse", "inverse dynamics: actuator forces and torques for a prescribed motion",
     "  kempe inverse examples/driven_slider_crank/driven_slider_crank.yaml\n"
     "  kempe inverse examples/stewart/driven.yaml --actuators slide1,slide2,slide3,slide4,slide5,slide6 -o "
     "legs.csv\n"
     "  kempe inverse examples/parallel_robot/parallel_robot.yaml --actuators a1,b1,a2 --weights a2=4\n",
     .dynamics = "plain", ANALYSES(.study = &inverse_study)},
    {CLI_LINEARIZE, "linearize", "linear state-space model about an equilibrium or the start",
     "  kempe linearize examples/four_bar/four_bar.yaml --at start\n"
     "  kempe linearize examples/suspension/suspension.yaml --inputs 'force(chassis.R.z)' --outputs q -o car.npz\n",
     .dynamics = "plain", ANALYSES(.study = &linearize_study)},
    {CLI_MODES, "modes", "modal analysis: eigenvalues, damping and mode shapes; root locus over a parameter",
     "  kempe modes examples/quarter_car/quarter_car.yaml\n"
     "  kempe modes examples/quarter_car/quarter_car.yaml --sweep \"damper=0:6000:61\" --svg locus.svg\n"
     "  kempe modes examples/suspension/suspension.yaml --report modes.html\n",
     .dynamics = "plain", ANALYSES(.study = &modes_study)},
    {CLI_CYCLES, "cycles", "limit cycles over a parameter, their stability, folds and Hopf points",
     "  kempe cycles examples/cooperrider/cooperrider.yaml --set start=0 --sweep V=60:75:16 --outputs 'q(y1)'\n"
     "  kempe cycles examples/cooperrider/cooperrider.yaml --set start=0 --sweep V=60:75 --svg diagram.svg\n",
     .usage = "FILE --sweep NAME=A:B:N [options]", .dynamics = "plain", ANALYSES(.study = &cycles_study)},
    {CLI_RESPONSE, "response", "frequency response: amplitude and phase of outputs for harmonic inputs, resonances",
     "  kempe response examples/suspension/suspension.yaml --inputs 'force(chassis.R.z)' \\\n"
     "      --outputs 'position(chassis.R).z' --frequencies 0.2:20 --svg car.svg\n",
     .usage = "FILE --inputs NAME,.. [options]", .dynamics = "plain", ANALYSES(.study = &response_study)},
    {CLI_COMFORT, "comfort", "ride comfort of a run: weighted accelerations (EN 12299), Sperling's ride index",
     "  kempe comfort examples/limousine/limousine.yaml --vertical 'acceleration(chassis.seat).z' --t-end 60\n"
     "  kempe comfort examples/tram/tram.yaml --t-end 30 --from 10 -o windows.csv\n",
     ANALYSES(.study = &comfort_study)},
    {CLI_SENSITIVITY, "sensitivity", "exact sensitivities with respect to parameters of the model",
     "  kempe sensitivity examples/four_bar/four_bar.yaml --parameters crank,base --t-end 1 -o by_lengths.csv\n"
     "  kempe sensitivity examples/stewart/stewart.yaml --method adjoint --outputs 'position(platform.P1).z'\n",
     .model_alone = true, ANALYSES(.study = &sensitivity_study)},
    {CLI_FIT, "fit", "parameters from measured motions: estimates, standard errors, intervals",
     "  kempe fit examples/four_bar/four_bar.yaml measured.csv --parameter crank_mass:0.1:10 -o found.csv\n"
     "  kempe fit examples/four_bar/four_bar.yaml measured.csv --columns q.rocker --parameter crank_mass,q.crank \\\n"
     "      --start found.csv --report fit.html\n",
     .usage = "FILE DATA.csv.. --parameter NAME[:LOW:HIGH].. [options]", .model_alone = true,
     ENSEMBLE(.study = &fit_study)},
    {CLI_OPTIMIZE, "optimize", "parameters for which a quantity of a run is least or largest, under limits",
     "  kempe optimize examples/four_bar/four_bar.yaml --minimize 'max(qd(rocker))' --parameter base:0.85:0.95 \\\n"
     "      --limit 'max(q(rocker)) > 2' --t-end 1 -o found.csv --report optimum.html\n",
     .usage = "FILE --minimize QUANTITY --parameter NAME:LOW:HIGH.. [options]", .model_alone = true,
     ENSEMBLE(.study = &optimize_study)},
    {CLI_ENSEMBLE, "ensemble", "simulate many instances with different parameters, in parallel vector lanes",
     "  kempe ensemble examples/four_bar/four_bar.yaml --values bars.csv -o ends.csv\n"
     "  kempe ensemble examples/four_bar/four_bar.yaml --sample crank=0.28:0.32,base=0.85:0.95 --instances 10000\n"
     "  kempe ensemble examples/four_bar/four_bar.yaml --sample crank=IT7,coupler=IT7 --instances 2000 --out "
     "bars.kempe\n",
     .usage = "FILE --values FILE | --sample RANGES [options]", .model_alone = true,
     ENSEMBLE(.study = &ensemble_study)},
    {CLI_GATHER, "gather", "check the parts of a result folder of an ensemble, and write them as one table or page",
     "  kempe gather bars.kempe\n"
     "  kempe gather bars.kempe -o bars.csv --history-output bars_history.csv\n"
     "  kempe gather bars.kempe --report bars.html\n",
     .usage = "FOLDER [options]", .gathers = true, .model_alone = true, ENSEMBLE(.run = run_gather)},
    {CLI_COMPARE, "compare", "compare formulations, integrators and tolerances against a reference solution",
     "  kempe compare examples/andrews/andrews.yaml --reference examples/andrews/reference.csv\n"
     "  kempe compare examples/four_bar/four_bar.yaml --rtol 1e-6,1e-9 --formulations reduced,dae --csv table.csv\n"
     "  kempe compare examples/andrews/andrews.yaml --report andrews.html\n",
     .study = &compare_study},
    {CLI_SHOW, "show", "print the parsed model, its equations or its program",
     "  kempe show examples/andrews/andrews.yaml --stats\n"
     "  kempe show examples/four_bar/four_bar.yaml --equations\n"
     "  kempe show examples/four_bar/four_bar.yaml --equations --stats\n",
     .usage = "FILE --model | --as NAME | --equations | --program | --stats", .run = run_show},
    {CLI_GENERATE, "generate", "generate equations in C, Octave or Python; operation counts",
     "  kempe generate examples/andrews/andrews.yaml --lang c -o andrews\n"
     "  kempe generate examples/andrews/andrews.yaml --count\n"
     "  kempe generate examples/andrews/andrews.yaml --count --sets M_C,invdyn --keep-parameters --body-inputs\n",
     .usage = "FILE --lang NAME | --count [options]", .model_alone = true, EXCHANGE(.run = run_generate)},
    {CLI_FMU, "fmu", "export as a functional mock-up unit (FMI 2.0 or 3.0) for other simulation programs",
     "  kempe fmu examples/four_bar/four_bar.yaml -o four_bar.fmu\n"
     "  kempe fmu examples/four_bar/four_bar.yaml -o four_bar.fmu --fmi 2 --kind cs\n",
     .usage = "FILE -o NAME.fmu [options]", .model_alone = true, EXCHANGE(.study = &fmu_study)},
    {0},
};
