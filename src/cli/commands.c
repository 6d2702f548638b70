/* SPDX-License-Identifier: BSD-3-Clause */
/* The commands, in the order of the help, and the studies of the core. Commands of a wing of the library (KEMPE_RAIL
 * and others) are in a separate file; in a build without the wing the command says that it is missing. */
#include "element_list.h"
#include "study.h"

#include <kempe/check.h>
#include <stdlib.h>
#include <string.h>

/* -- studies ----------------------------------------------------------------------------------------- */

/* All rows of a run; a picture has the outputs that --x and --y name, also outputs that the model does not list. */
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
#ifdef KEMPE_REPORT
static kempe_status any_kempe_trajectory_write_report(const cli_job *j, void *result, const char *path)
{
    return j->earlier ? kempe_trajectory_write_report_against(result, j->earlier, path)
                      : kempe_trajectory_write_report(result, path);
}
#endif
ANIMATION_WRITER(kempe_trajectory_write_animation)
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
      .files = {REPORT(kempe_assembly_write_report)})
STUDY(branches, kempe_branches, kempe_branches_new(j->system, s->seed, result), .table = NULL)
STUDY(simulate, kempe_trajectory, simulate_judged(j->system, &s->run, result), .table = kempe_trajectory_rows,
      .files = {REPORT(kempe_trajectory_write_report), ANIMATION(kempe_trajectory_write_animation)})
STUDY(compare, kempe_comparison, kempe_comparison_new(j->system, &s->compare, result), .table = kempe_comparison_rows,
      .files = {REPORT(kempe_comparison_write_report)})

/* -- commands with separate steps -------------------------------------------------------------------- */

static kempe_status run_assemble(const cli_job *j)
{
    return cli_run_study(j, j->settings->branches ? &cli_branches_study : &cli_assembly_study);
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
    if (cli_is_element(j->settings->file))
        return cli_show_element(j);
    return cli_worse(KEMPE_OK, cli_report(j, print_view, NULL));
}

void cli_default(unsigned command, cli_settings *s)
{
    if (command & CLI_SHOW && !(s->show_as || s->show_equations || s->show_program || s->show_stats))
        s->show_model = 1;
}

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
        {CLI_ENSEMBLE, s->values ? s->sample.ranges != NULL : !s->sample.ranges && !*s->quantities && !*s->limits,
         "ensemble needs either --values FILE or --sample NAME=A:B,..; with --quantity and neither of them it runs the "
         "model itself"},
        {CLI_ENSEMBLE, !s->sample.ranges && (s->sample.count || s->sample.design || s->sample.correlations),
         "--instances, --design and --correlate belong to a sample: give --sample NAME=A:B,.."},
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
        {CLI_REDUCE, !s->output, "the file of the body is missing: --output BODY.npz"},
        {CLI_SHOW, views > 1 && !passes, "show prints one of --model, --as, --equations, --program, --stats"},
    };
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++)
        if (rows[k].command & command && rows[k].lacks)
            return rows[k].sentence;
    return NULL;
}

/* -- the commands ------------------------------------------------------------------------------------ */

/* The action of a command; NULL: its wing is not in the build. */
#ifdef KEMPE_ANALYSES
#define IN_ANALYSES(action) action
#else
#define IN_ANALYSES(action) NULL
#endif
#ifdef KEMPE_RAIL
#define IN_RAIL(action) action
#else
#define IN_RAIL(action) NULL
#endif
#ifdef KEMPE_EXCHANGE
#define IN_EXCHANGE(action) action
#else
#define IN_EXCHANGE(action) NULL
#endif
#ifdef KEMPE_ENSEMBLE
#define IN_ENSEMBLE(action) action
#else
#define IN_ENSEMBLE(action) NULL
#endif
#ifdef KEMPE_WORKBENCH
#define IN_WORKBENCH(action) action
#else
#define IN_WORKBENCH(action) NULL
#endif
#ifdef KEMPE_LANGUAGE_SERVER
#define IN_LANGUAGE_SERVER(action) action
#else
#define IN_LANGUAGE_SERVER(action) NULL
#endif

const cli_command cli_commands[] = {
    {CLI_NEW, "new", "write a first model, NAME.yaml: a four-bar linkage with comments",
     "  kempe new four_bar\n"
     "  kempe check four_bar.yaml\n"
     "  kempe simulate four_bar.yaml\n"
     "  kempe new --elements\n",
     .usage = "NAME | --elements [options]", .without_model = true, .run = cli_new},
    {CLI_CHECK, "check", "model diagnostics: degrees of freedom, redundant closures, independent coordinates",
     "  kempe check examples/andrews/andrews.yaml\n", .study = &cli_check_study},
    {CLI_ASSEMBLE, "assemble", "assembly: close the loops, starting from the model's start values; assembly modes",
     "  kempe assemble examples/four_bar/four_bar.yaml --json start.json\n"
     "  kempe assemble examples/four_bar/four_bar.yaml --branches\n",
     .run = run_assemble},
    {CLI_VIEW, "view", "show a page of results, or a model's assembled start, in a browser",
     "  kempe view four_bar.html\n"
     "  kempe view examples/stewart/stewart.yaml\n",
     .opens_pages = true, .dynamics = "plain", .run = cli_view},
    {CLI_WORKBENCH, "workbench", "edit and run a model in a browser: its text, the mechanism, results",
     "  kempe workbench examples/four_bar/four_bar.yaml\n"
     "  kempe workbench examples/four_bar/four_bar.yaml --port 8080 --no-browser\n",
     .without_model = true, .wing = "WORKBENCH", .run = IN_WORKBENCH(cli_workbench)},
    {CLI_KINEMATICS, "kinematics", "position analysis: sweep coordinates; velocities, accelerations, dead centres",
     "  kempe kinematics examples/four_bar/four_bar.yaml --sweep \"A=0 deg:360 deg\" -o turn.csv\n"
     "  kempe kinematics examples/driven_slider_crank/driven_slider_crank.yaml --sweep t=0:1:101\n"
     "  kempe kinematics examples/chebyshev/chebyshev.yaml --sweep \"crank=0 deg:360 deg\" --svg paths.svg\n",
     .usage = "FILE --sweep NAME=A:B[,NAME=A:B..] [options]", .dynamics = "plain", .wing = "ANALYSES",
     .study = IN_ANALYSES(&cli_kinematics_study)},
    {CLI_EQUILIBRIUM, "equilibrium", "static or steady-state equilibrium and its stability",
     "  kempe equilibrium examples/four_bar/four_bar.yaml --global\n"
     "  kempe equilibrium examples/governor/governor.yaml --rates shaft=5.5\n"
     "  kempe equilibrium examples/governor/governor.yaml --rates shaft=5.5 --solve-for 'qd(shaft)' \\\n"
     "      --hold slider=0.6\n",
     .dynamics = "plain", .wing = "ANALYSES", .study = IN_ANALYSES(&cli_equilibrium_study)},
    {CLI_CONTACT, "contact", "wheel-rail contact table: contact positions, creepages and forces over a sweep",
     "  kempe contact examples/manchester/manchester.yaml --sweep \"shift=0:10 mm:21\"\n"
     "  kempe contact examples/manchester/manchester.yaml --sweep \"shift=0:10 mm:21\" --law fastsim \\\n"
     "      --svg contact.svg\n"
     "  kempe contact examples/conicity/conicity.yaml --sweep \"shift=-9 mm:9 mm:181\" \\\n"
     "      --conicity \"1 mm:7 mm:13\"\n",
     .usage = "FILE --sweep NAME=A:B:N[,NAME=A:B..] [options]", .dynamics = "plain", .wing = "RAIL",
     .study = IN_RAIL(&cli_contact_study)},
    {CLI_SIMULATE, "simulate", "simulate with one formulation; accuracy checks of the result",
     "  kempe simulate examples/andrews/andrews.yaml -o andrews.csv\n"
     "  kempe simulate examples/andrews/andrews.yaml --report andrews.html\n"
     "  kempe simulate examples/four_bar/four_bar.yaml --animation four_bar.glb\n"
     "  kempe simulate examples/andrews/andrews.yaml --plot andrews.svg --y 'q(beta), force(spring)'\n"
     "  kempe simulate examples/slider_crank/slider_crank.yaml --rtol 1e-8 --t-end 2 --output-step 0.01\n"
     "  kempe simulate examples/double_four_bar/double_four_bar.yaml --at equilibrium\n"
     "  kempe simulate examples/andrews/andrews.yaml --formulation dae --json -\n"
     "  kempe simulate --from bars.kempe --instance 17 --report bar17.html\n",
     .study = &cli_simulate_study},
    {CLI_INVERSE, "inverse", "inverse dynamics: actuator forces and torques for a prescribed motion",
     "  kempe inverse examples/driven_slider_crank/driven_slider_crank.yaml\n"
     "  kempe inverse examples/stewart/driven.yaml \\\n"
     "      --actuators slide1,slide2,slide3,slide4,slide5,slide6 -o legs.csv\n"
     "  kempe inverse examples/parallel_robot/parallel_robot.yaml --actuators a1,b1,a2 --weights a2=4\n",
     .dynamics = "plain", .wing = "ANALYSES", .study = IN_ANALYSES(&cli_inverse_study)},
    {CLI_LINEARIZE, "linearize", "linear state-space model about an equilibrium or the start",
     "  kempe linearize examples/four_bar/four_bar.yaml --at start\n"
     "  kempe linearize examples/suspension/suspension.yaml --inputs 'force(chassis.R.z)' --outputs q \\\n"
     "      -o car.npz\n",
     .dynamics = "plain", .wing = "ANALYSES", .study = IN_ANALYSES(&cli_linearize_study)},
    {CLI_MODES, "modes", "modal analysis: eigenvalues, damping and mode shapes; root locus over a parameter",
     "  kempe modes examples/quarter_car/quarter_car.yaml\n"
     "  kempe modes examples/quarter_car/quarter_car.yaml --sweep \"damper=0:6000:61\" --svg locus.svg\n"
     "  kempe modes examples/suspension/suspension.yaml --report modes.html\n",
     .dynamics = "plain", .wing = "ANALYSES", .study = IN_ANALYSES(&cli_modes_study)},
    {CLI_CYCLES, "cycles", "limit cycles over a parameter, their stability, folds and Hopf points",
     "  kempe cycles examples/cooperrider/cooperrider.yaml --set start=0 --sweep V=60:75:16 \\\n"
     "      --outputs 'q(y1)'\n"
     "  kempe cycles examples/cooperrider/cooperrider.yaml --set start=0 --sweep V=60:75 --svg diagram.svg\n",
     .usage = "FILE --sweep NAME=A:B:N [options]", .dynamics = "plain", .wing = "ANALYSES",
     .study = IN_ANALYSES(&cli_cycles_study)},
    {CLI_RESPONSE, "response", "frequency response: amplitude and phase of outputs for harmonic inputs, resonances",
     "  kempe response examples/suspension/suspension.yaml --inputs 'force(chassis.R.z)' \\\n"
     "      --outputs 'position(chassis.R).z' --frequencies 0.2:20 --svg car.svg\n",
     .usage = "FILE --inputs NAME,.. [options]", .dynamics = "plain", .wing = "ANALYSES",
     .study = IN_ANALYSES(&cli_response_study)},
    {CLI_COMFORT, "comfort", "ride comfort of a run: weighted accelerations (EN 12299), Sperling's ride index",
     "  kempe comfort examples/limousine/limousine.yaml --vertical 'acceleration(chassis.seat).z' \\\n"
     "      --t-end 60\n"
     "  kempe comfort examples/tram/tram.yaml --t-end 30 --from 10 -o windows.csv\n",
     .wing = "ANALYSES", .study = IN_ANALYSES(&cli_comfort_study)},
    {CLI_SENSITIVITY, "sensitivity", "exact sensitivities with respect to parameters of the model",
     "  kempe sensitivity examples/four_bar/four_bar.yaml --parameters crank,base --t-end 1 \\\n"
     "      -o by_lengths.csv\n"
     "  kempe sensitivity examples/stewart/stewart.yaml --method adjoint \\\n"
     "      --outputs 'position(platform.P1).z'\n",
     .model_alone = true, .wing = "ANALYSES", .study = IN_ANALYSES(&cli_sensitivity_study)},
    {CLI_FIT, "fit", "parameters from measured motions: estimates, standard errors, intervals",
     "  kempe fit examples/four_bar/four_bar.yaml measured.csv --parameter crank_mass:0.1:10 -o found.csv\n"
     "  kempe fit examples/four_bar/four_bar.yaml measured.csv --columns q.rocker \\\n"
     "      --parameter crank_mass,q.crank \\\n"
     "      --start found.csv --report fit.html\n",
     .usage = "FILE DATA.csv.. --parameter NAME[:LOW:HIGH].. [options]", .model_alone = true, .wing = "ENSEMBLE",
     .study = IN_ENSEMBLE(&cli_fit_study)},
    {CLI_OPTIMIZE, "optimize", "parameters for which a quantity of a run is least or largest, under limits",
     "  kempe optimize examples/four_bar/four_bar.yaml --minimize 'max(qd(rocker))' \\\n"
     "      --parameter base:0.85:0.95 \\\n"
     "      --limit 'max(q(rocker)) > 2' --t-end 1 -o found.csv --report optimum.html\n",
     .usage = "FILE --minimize QUANTITY --parameter NAME:LOW:HIGH.. [options]", .model_alone = true, .wing = "ENSEMBLE",
     .study = IN_ENSEMBLE(&cli_optimize_study)},
    {CLI_ENSEMBLE, "ensemble", "simulate many instances with different parameters",
     "  kempe ensemble examples/four_bar/four_bar.yaml --values bars.csv -o ends.csv\n"
     "  kempe ensemble examples/four_bar/four_bar.yaml --sample crank=0.28:0.32,base=0.85:0.95 \\\n"
     "      --instances 10000\n"
     "  kempe ensemble examples/four_bar/four_bar.yaml --sample crank=IT7,coupler=IT7 \\\n"
     "      --instances 2000 --out bars.kempe\n",
     .usage = "FILE --values FILE | --sample RANGES [options]", .model_alone = true, .wing = "ENSEMBLE",
     .study = IN_ENSEMBLE(&cli_ensemble_study)},
    {CLI_GATHER, "gather", "check the parts of a result folder of an ensemble, write them as one table or page",
     "  kempe gather bars.kempe\n"
     "  kempe gather bars.kempe -o bars.csv --history-output bars_history.csv\n"
     "  kempe gather bars.kempe --report bars.html\n",
     .usage = "FOLDER [options]", .gathers = true, .model_alone = true, .wing = "ENSEMBLE",
     .run = IN_ENSEMBLE(cli_gather)},
    {CLI_COMPARE, "compare", "compare formulations, integrators and tolerances against a reference solution",
     "  kempe compare examples/andrews/andrews.yaml --reference examples/andrews/reference.csv\n"
     "  kempe compare examples/four_bar/four_bar.yaml --rtol 1e-6,1e-9 --formulations reduced,dae \\\n"
     "      --csv table.csv\n"
     "  kempe compare examples/andrews/andrews.yaml --report andrews.html\n",
     .study = &cli_compare_study},
    {CLI_SHOW, "show", "print the parsed model, its equations or its program",
     "  kempe show examples/andrews/andrews.yaml --stats\n"
     "  kempe show examples/four_bar/four_bar.yaml --equations\n"
     "  kempe show examples/four_bar/four_bar.yaml --equations --stats\n"
     "  kempe show kempe:gas_spring.yaml\n",
     .usage = "FILE [--model | --as NAME | --equations | --program | --stats]", .run = run_show},
    {CLI_GENERATE, "generate", "generate equations in C, Octave or Python, for CasADi, JAX and PyTorch; counts",
     "  kempe generate examples/andrews/andrews.yaml --lang c -o andrews\n"
     "  kempe generate examples/andrews/andrews.yaml --count\n"
     "  kempe generate examples/andrews/andrews.yaml --count --sets M_C,invdyn --keep-parameters \\\n"
     "      --body-inputs\n",
     .usage = "FILE --lang NAME | --count [options]", .model_alone = true, .wing = "EXCHANGE",
     .run = IN_EXCHANGE(cli_generate)},
    {CLI_FMU, "fmu", "export as a functional mock-up unit (FMI 2.0 or 3.0) for other simulation programs",
     "  kempe fmu examples/four_bar/four_bar.yaml -o four_bar.fmu\n"
     "  kempe fmu examples/four_bar/four_bar.yaml -o four_bar.fmu --fmi 2 --kind cs\n",
     .usage = "FILE -o NAME.fmu [options]", .model_alone = true, .wing = "EXCHANGE", .run = IN_EXCHANGE(cli_fmu)},
    {CLI_REDUCE, "reduce", "reduce a mesh of finite elements to the file of a flexible body (Craig-Bampton)",
     "  kempe reduce blade_mesh.npz --interface root=x=0 --interface tip=x=0.5 --modes 4 -o blade.npz\n"
     "  kempe reduce K.mtx --mass M.mtx --nodes nodes.txt --units 'mm t s' --interface A=1-9 --modes 6 \\\n"
     "      -o arm.npz\n"
     "  kempe reduce job.sti --units 'mm t s' --interface A=BORE --interface B=PIN --modes 10 -o rod.npz\n",
     .usage = "MESH --interface NAME=NODES.. -o BODY.npz [options]", .without_model = true, .wing = "EXCHANGE",
     .run = IN_EXCHANGE(cli_reduce)},
    {CLI_LANGUAGE_SERVER, "language-server", "serve editors: errors, completion and names of a model while it is typed",
     "  kempe language-server --stdio\n", .usage = "[options]", .without_model = true, .wing = "LANGUAGE_SERVER",
     .run = IN_LANGUAGE_SERVER(cli_language_server)},
    {0},
};
