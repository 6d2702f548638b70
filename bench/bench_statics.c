/* SPDX-License-Identifier: BSD-3-Clause */
/* Equilibrium and modes of a car on bushings, from the file on: bench_statics [MODEL]. The time of each part, the
 * median of some rounds; without a model examples/limousine, and with KEMPE_MBS limousine63.mbs with a spring in each
 * joint. Exit code 1: examples/limousine takes longer than a tenth of a second, does not carry its weight on its tyres,
 * or grows. */
#include "analyses/derivatives/spectrum.h"
#include "analyses/equilibrium/equilibrium_study.h"
#include "bench.h"
#include "constraints/closing/assemble.h"
#include "constraints/evaluation/evaluator.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include <kempe/check.h>
#include <kempe/settings.h>
#include <math.h>
#include <string.h>

enum { ROUNDS = 9, READ = 0, DERIVE, PREPARE, STAND, SWING, PARTS, MOST = 512 };

static const char *const parts[PARTS] = {"reading", "deriving", "preparing", "equilibrium", "modes"};

/* Result of a round. */
typedef struct outcome {
    double time[PARTS], q[MOST];
    double growth, slowest, fastest; /* largest real part; imaginary parts over 2 pi */
    double carried; /* part of the weight that bushings on the ground carry, whose forces are outputs */
    int n, p, iterations, zeros;
} outcome;

static void give_up(const kempe_context *context)
{
    fprintf(stderr, "%s\n", kempe_context_message(context));
    exit(1);
}

static void note_modes(const kmp_spectrum *s, outcome *o)
{
    o->growth = -INFINITY;
    o->slowest = INFINITY;
    o->fastest = 0;
    o->zeros = s->zeros;
    for (int k = s->zeros; k < s->count; k++) {
        double hertz = fabs(s->im[k]) / (2 * 3.14159265358979323846);
        o->growth = fmax(o->growth, s->re[k]);
        o->slowest = hertz > 0 ? fmin(o->slowest, hertz) : o->slowest;
        o->fastest = fmax(o->fastest, hertz);
    }
}

/* Upwards, over the weight of all bodies; the linear equations are at rest there. */
static double carried(const kempe_model *model, const kmp_linear *l)
{
    double weight = 0, sum = 0;
    for (int k = 1; k < model->body_count; k++)
        weight -= model->bodies[k].mass.value * model->gravity[2].value;
    const double *shown = kmp_eval_shown(l->eval, 0, l->q, l->qd, l->qdd, l->lambda);
    for (int o = 0; o < model->output_count; shown += kmp_output_width(model, &model->outputs[o]), o++) {
        if (model->outputs[o].kind != KMP_OUTPUT_FORCE)
            continue;
        const kmp_force *force = &model->forces[model->outputs[o].index];
        if (force->kind == KMP_FORCE_BUSHING && model->points[force->point[0]].body == 0)
            sum += shown[2];
    }
    return sum / weight;
}

/* The work of one round on a model that is read. */
static void analyse(kempe_context *context, const kempe_model *model, outcome *o)
{
    static kmp_search search;
    kempe_system *system = NULL;
    kempe_assembly *start = NULL;
    kmp_linear linear;
    kmp_spectrum spectrum;
    double begin = bench_now();
    if (kempe_system_new_with_algorithm(model, "plain", &system))
        give_up(context);
    o->time[DERIVE] = bench_now() - begin;
    begin = bench_now();
    if (kempe_assembly_new(system, &start) || kmp_linear_init(&linear, system, "tape") ||
        kmp_linear_choose(&linear, 0, start->q, NULL, 0))
        give_up(context);
    o->time[PREPARE] = bench_now() - begin;
    begin = bench_now();
    memcpy(o->q, start->q, (size_t)linear.n * sizeof *o->q);
    search = (kmp_search){.newton = true};
    if (kmp_equilibrium_find(&linear, 0, o->q, &search))
        give_up(context);
    o->time[STAND] = bench_now() - begin;
    begin = bench_now();
    if (kmp_spectrum_init(&spectrum, linear.p, linear.mass, NULL, linear.damping, linear.stiffness, false))
        give_up(context);
    o->time[SWING] = bench_now() - begin;
    note_modes(&spectrum, o);
    o->carried = carried(model, &linear);
    o->n = linear.n;
    o->p = linear.p;
    o->iterations = search.iterations;
    kmp_spectrum_free(&spectrum);
    kmp_linear_free(&linear);
    kempe_assembly_free(start);
    kempe_system_free(system);
}

typedef kempe_status reader(kempe_context *context, const char *source, kempe_model **model);

static outcome measure(reader *read, const char *source)
{
    outcome all[ROUNDS], median;
    for (int k = 0; k < ROUNDS; k++) {
        kempe_context *context = kempe_context_new();
        kempe_model *model = NULL;
        double begin = bench_now();
        if (read(context, source, &model))
            give_up(context);
        all[k].time[READ] = bench_now() - begin;
        analyse(context, model, &all[k]);
        kempe_model_free(model);
        kempe_context_free(context);
    }
    median = all[0];
    for (int part = 0; part < PARTS; part++) {
        double times[ROUNDS];
        for (int k = 0; k < ROUNDS; k++)
            times[k] = all[k].time[part];
        median.time[part] = bench_median(ROUNDS, times);
    }
    return median;
}

/* Returns the whole time. */
static double show(const char *name, const outcome *o)
{
    double total = 0;
    printf(
        "%s: %d coordinates, %d degrees of freedom; %d iterations; %d zero modes, others %.3g to %.3g Hz, real parts "
        "below %.3g 1/s\n",
        name, o->n, o->p, o->iterations, o->zeros, o->slowest, o->fastest, o->growth);
    for (int part = 0; part < PARTS; part++) {
        printf("  %-12s %8.2f ms\n", parts[part], 1e3 * o->time[part]);
        total += o->time[part];
    }
    printf("  %-12s %8.2f ms\n", "altogether", 1e3 * total);
    return total;
}

/* -- the cars ----------------------------------------------------------------------------------------------- */

static kempe_status read_file(kempe_context *context, const char *path, kempe_model **model)
{
    return kempe_model_read(context, path, model);
}

/* A car of ROBOTRAN's with a stiff spring and a damper in each joint, at rest where it starts. */
static kempe_status read_with_springs(kempe_context *context, const char *path, kempe_model **model)
{
    kempe_model *bare = NULL;
    kmp_text text = {0}, label = {0};
    kempe_status status = kempe_model_read(context, path, &bare);
    if (status)
        return status;
    kmp_text_printf(&text, "kempe: 1\ngravity: [0, 0, -9.81]\ninclude: [{file: %s}]\nforces:\n",
                    strrchr(path, '/') + 1);
    kmp_text_printf(&label, "%.*s/sprung.yaml", (int)(strrchr(path, '/') - path), path);
    for (int k = 0; k < bare->motion_count; k++)
        kmp_text_printf(&text, "  k%d: {joint: %s, spring: {stiffness: %s, damping: 500, rest: %.17g}}\n", k,
                        bare->motions[k].name, bare->motions[k].rotation ? "2e4" : "2e5", bare->start.q[k].value);
    status = kempe_model_read_text(context, text.s, label.s, model);
    kmp_text_free(&text);
    kmp_text_free(&label);
    kempe_model_free(bare);
    return status;
}

static int own_car(void)
{
    const double most = 0.1;
    outcome o = measure(read_file, "examples/limousine/limousine.yaml");
    double total = show("limousine", &o);
    printf("  tyres carry %.15g of the weight\n", o.carried);
    bool quick = total < most, carried = fabs(o.carried - 1) < 1e-9, calm = o.growth < 0;
    if (!quick)
        printf("  longer than %.3g s\n", most);
    if (!carried)
        printf("  not the weight\n");
    if (!calm)
        printf("  a mode grows\n");
    return !quick || !carried || !calm;
}

int bench_statics(int argc, char **argv)
{
    if (argc > 1) {
        outcome o = measure(read_file, argv[1]);
        (void)show(argv[1], &o);
        return 0;
    }
    int missed = own_car();
    const char *folder = getenv("KEMPE_MBS");
    if (folder) {
        char path[1024];
        (void)snprintf(path, sizeof path, "%s/limousine63.mbs", folder);
        outcome o = measure(read_with_springs, path);
        (void)show("limousine63, a spring in each joint", &o);
    }
    return missed;
}
