/* SPDX-License-Identifier: BSD-3-Clause */
/* Computes each state from the last one, value by value; where that is too far, by parts of the step. */
#include "rail/wheel_contact/contact_sweep.h"
#include "analyses/parts/substep.h"
#include "backend/machine.h"
#include "base/memory.h"
#include "constraints/evaluation/charts.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/inexact/nearest_exact.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "platform/platform.h"
#include "rail/wheel_contact/contact_conicity.h"
#include "rail/wheel_contact/contact_pressure.h"
#include "symbolic/table_function.h"
#include <kempe/rolling_contact.h>
#include <kempe/vehicle.h>
#include <math.h>
#include <string.h>

#define LEAST_PART (1.0 / 64) /* of the step from value to value */

/* Halvings of a step in which a contact may jump: at least, so that a point of a curve is not taken for one of a line;
 * at most, so that a jump is known to a thousandth of the step. */
enum { LEAST_HALVINGS = 2, MOST_HALVINGS = 10 };

/* Smallest deviation of the difference of the rolling radii from a line that is followed, m: at amplitudes of 1 mm and
 * more it changes a conicity by 0.0005 at most. */
#define STRAIGHT 1e-6

typedef struct job {
    kempe_contacts *t;
    kmp_arena arena;
    kmp_linear linear;
    kmp_operating *start;
    double *q, *before;                    /* n: the last state, in the charts of the evaluator */
    double *q_row, *chart_row;             /* the state of a row and its charts */
    kempe_contact_patch *patch;            /* of a value between rows */
    double *here, *there, *from, *between; /* values of the swept quantities */
    double *parameters;
    int shown; /* the first output of wheels among all computed ones */
} job;

static kempe_context *context_of(const job *j)
{
    return j->t->given->context;
}

enum { USUAL_VALUES = 21, MOST_VALUES = 100000 };

/* The index of a coordinate among the fixed ones; -1: it is not fixed. */
static int hold_of(const kempe_contacts *t, int coordinate)
{
    for (int k = 0; k < t->hold_count; k++)
        if (t->hold[k].coordinate == coordinate)
            return k;
    return -1;
}

/* -- swept quantities ---------------------------------------------------------------------------------- */

static kempe_status add_coordinate(kempe_contacts *t, const kmp_range *range, kmp_swept_parameter *swept)
{
    const kempe_model *model = t->given->model;
    int c = -1;
    KMP_TRY(kmp_coordinate_find(model, "sweep", range->name, strlen(range->name), &c));
    KMP_TRY(kmp_range_fits_motion(model, "--sweep", range, c, 0));
    if (hold_of(t, c) >= 0)
        return kmp_fail(t->given->context, KEMPE_E_ARGUMENT, "--sweep: '%s' is given twice", range->name);
    *swept = (kmp_swept_parameter){-1, t->hold_count};
    t->hold[t->hold_count++] = (kmp_steady){.coordinate = c, .how = KMP_RATE_HELD};
    return KEMPE_OK;
}

/* -- the rest ------------------------------------------------------------------------------------------ */

static kempe_status read_hold(kempe_contacts *t, const char *words)
{
    const kempe_model *model = t->given->model;
    int *list = KMP_ARENA_NEW(&t->arena, int, t->given->n), count = 0;
    KMP_TRY(kmp_made(t->given->context, list));
    KMP_TRY(kmp_coordinates_read(model, "hold", words, list, &count));
    for (int k = 0; k < count; k++) {
        if (hold_of(t, list[k]) >= 0)
            return kmp_fail(t->given->context, KEMPE_E_ARGUMENT, "hold: '%s' is swept", model->motions[list[k]].name);
        t->hold[t->hold_count++] = (kmp_steady){.coordinate = list[k], .how = KMP_RATE_HELD};
    }
    return KEMPE_OK;
}

static const char rolling_word[] = "half-space";

const char *kmp_contact_law_word(const kempe_contacts *t)
{
    return t->rolls ? rolling_word : t->has_law ? kempe_contact_law_name(t->law) : NULL;
}

static kempe_status read_law(kempe_contacts *t, const char *word)
{
    kmp_text sentence = {0};
    const char *name;
    for (int law = KEMPE_CREEP_NONE; word && (name = kempe_contact_law_name((kempe_creep_law)law)) != NULL; law++) {
        if (strcmp(name, word) == 0) {
            t->has_law = true;
            t->law = (kempe_creep_law)law;
        }
        if (law == KEMPE_CREEP_NONE)
            kmp_text_printf(&sentence, "unknown creep law '%s'; available: %s", word, name);
        else
            kmp_text_printf(&sentence, ", %s", name);
    }
    kmp_text_printf(&sentence, ", %s", rolling_word);
    t->rolls = word && strcmp(word, rolling_word) == 0;
    t->has_law = t->has_law || t->rolls;
    if (word && !t->has_law)
        return kmp_fail_text(t->given->context, KEMPE_E_ARGUMENT, &sentence);
    kmp_text_free(&sentence);
    return KEMPE_OK;
}

/* Reads the options into a table that has its system: swept quantities, fixed ones, law, values. */
static kempe_status read_request(kempe_contacts *t, const kempe_contact_options *options)
{
    kempe_context *context = t->given->context;
    if (t->given->model->wheel_count == 0)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "the model has no wheels: define them in the section 'wheels' (docs/model/wheels.md)");
    if (!options->sweep || !*options->sweep)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "the sweep is missing: a coordinate or a parameter with its range, as in 'y=0:10 mm:21'");
    t->hold = KMP_ARENA_NEW(&t->arena, kmp_steady, t->given->n);
    KMP_TRY(kmp_made(context, t->hold));
    KMP_TRY(kmp_ranges_read(context, options->sweep, &t->over));
    if (t->over.count > t->given->n + t->given->model->parameter_count)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "--sweep: there are more ranges than coordinates and parameters");
    t->swept = KMP_ARENA_NEW(&t->arena, kmp_swept_parameter, t->over.count);
    KMP_TRY(kmp_made(t->given->context, t->swept));
    for (int k = 0; k < t->over.count; k++)
        if (kmp_parameter_find(t->given->model, t->over.range[k].name) >= 0) {
            KMP_TRY(kmp_range_fits_variable(t->given->model, "--sweep", &t->over.range[k]));
            t->swept[k] = (kmp_swept_parameter){t->parameter_count++, -1};
        } else {
            KMP_TRY(add_coordinate(t, &t->over.range[k], &t->swept[k]));
        }
    int points = options->points;
    int count = points;
    bool varies = false;
    for (int k = 0; k < t->over.count; k++) {
        const kmp_range *range = &t->over.range[k];
        count = count == 0 && range->count > 1 ? range->count : count;
        varies = varies || range->from != range->to;
    }
    t->requested = count != 0 ? count : varies ? USUAL_VALUES : 1;
    if (t->requested < 1 || t->requested > MOST_VALUES || (t->requested == 1 && varies))
        return kmp_fail(t->given->context, KEMPE_E_ARGUMENT, "--sweep: %d values are not possible: 2 to %d",
                        t->requested, MOST_VALUES);
    KMP_TRY(read_hold(t, options->hold));
    KMP_TRY(read_law(t, options->law));
    KMP_TRY(kmp_contact_pressure_request(t, options->pressure ? options->pressure : t->rolls ? "half-space" : NULL));
    if (t->rolls && t->pressure != KMP_PRESSURE_HALF_SPACE)
        return kmp_fail(
            context, KEMPE_E_ARGUMENT,
            "--law half-space: the forces belong to the pressures of a grid: give --pressure half-space, or "
            "no --pressure");
    return kmp_contact_conicity_request(t, options);
}

/* -- the system ---------------------------------------------------------------------------------------- */

static kempe_status make_system(kempe_contacts *t)
{
    const char **names = KMP_ARENA_NEW(&t->arena, const char *, t->over.count);
    KMP_TRY(kmp_made(t->given->context, names));
    for (int k = 0; k < t->over.count; k++)
        if (t->swept[k].parameter >= 0)
            names[t->swept[k].parameter] = t->over.range[k].name;
    KMP_TRY(kmp_variant_new(t->given->model, t->parameter_count, names, &t->variant));
    /* Replaces the model's outputs by the outputs of its wheels: the contacts of all, then their poses. */
    kempe_model *copy = kmp_variant_model(t->variant);
    bool poses = t->pressure != KMP_PRESSURE_NONE || t->conicities.count > 0;
    int count = copy->wheel_count;
    kmp_output *outputs = KMP_ARENA_NEW(&copy->arena, kmp_output, 2 * count);
    KMP_TRY(kmp_made(copy->context, outputs));
    for (int k = 0; k < count; k++) {
        outputs[k] = (kmp_output){.kind = KMP_OUTPUT_CONTACT, .index = k};
        outputs[count + k] = (kmp_output){.kind = KMP_OUTPUT_POSE, .index = k};
    }
    copy->outputs = outputs;
    copy->output_count = poses ? 2 * count : count;
    return kmp_system_of_variant(t->variant, &t->system);
}

static kempe_status make_table(kempe_contacts *t)
{
    const kempe_model *model = t->system->model;
    ptrdiff_t rows = t->requested;
    t->wheel_count = model->wheel_count;
    t->first = KMP_ARENA_NEW(&t->arena, int, t->wheel_count + 1);
    KMP_TRY(kmp_made(t->given->context, t->first));
    for (int k = 0; k < t->wheel_count; k++)
        t->first[k + 1] = t->first[k] + kmp_wheel_contacts(&model->wheels[k]);
    t->patch = KMP_ARENA_NEW(&t->arena, kempe_contact_patch, rows * t->first[t->wheel_count]);
    if (t->pressure != KMP_PRESSURE_NONE) {
        t->outline = KMP_ARENA_NEW(&t->arena, kmp_patch_outline, rows * t->first[t->wheel_count]);
        KMP_TRY(kmp_made(t->given->context, t->outline));
    }
    t->conicities.row = KMP_ARENA_NEW(&t->arena, kmp_displaced, rows);
    t->conicities.between = KMP_ARENA_NEW(&t->arena, kmp_conicity_points, rows);
    return kmp_made(t->given->context, KMP_ARENA_MAKE(&t->arena, KMP_ROOM(double, rows, &t->value),
                                                      KMP_ROOM(double, rows * t->system->n, &t->q, &t->qd)));
}

/* -- the start ----------------------------------------------------------------------------------------- */

static kempe_status set_parameters(job *j, const double *point)
{
    kempe_contacts *t = j->t;
    if (t->parameter_count == 0)
        return KEMPE_OK;
    for (int k = 0; k < t->over.count; k++)
        if (t->swept[k].parameter >= 0)
            j->parameters[t->swept[k].parameter] = point[k];
    return kmp_linear_vary(&j->linear, t->system, t->variant, j->parameters);
}

static kempe_status read_freed(job *j, const char *words)
{
    kempe_contacts *t = j->t;
    const kempe_model *model = t->system->model;
    int *list = KMP_ARENA_NEW(&j->arena, int, t->system->n), count = 0;
    KMP_TRY(kmp_made(context_of(j), list));
    KMP_TRY(strcmp(words, "-") == 0 ? KEMPE_OK : kmp_coordinates_read(model, "freed", words, list, &count));
    for (int k = 0; k < t->hold_count; k++)
        t->hold[k].how = KMP_RATE_HELD;
    for (int k = 0; k < count; k++) {
        int hold = hold_of(t, list[k]);
        if (hold < 0 || t->hold[hold].rate == 0)
            return kmp_fail(
                context_of(j), KEMPE_E_ARGUMENT,
                "solve-for: '%s' does not move at the start, or the closures move it: give it a rate there (start: qd)",
                model->motions[list[k]].name);
        t->hold[hold].how = KMP_RATE_FREED;
    }
    return KEMPE_OK;
}

static kempe_status begin(job *j, const kempe_contact_options *options)
{
    kempe_contacts *t = j->t;
    const ptrdiff_t n = t->system->n, leads = t->over.count;
    bool made =
        KMP_ARENA_MAKE(&j->arena, KMP_ROOM(double, leads, &j->here, &j->there, &j->from, &j->between, &j->parameters),
                       KMP_ROOM(double, n, &j->q, &j->before, &j->q_row),
                       KMP_ROOM(double, (ptrdiff_t)KMP_CHART_SIZE * t->system->chart_count, &j->chart_row),
                       KMP_ROOM(kempe_contact_patch, t->first[t->wheel_count], &j->patch));
    KMP_TRY(kmp_made(context_of(j), made));
    for (int k = 0; k < t->over.count; k++)
        j->here[k] = t->over.range[k].from;
    KMP_TRY(set_parameters(j, j->here));
    KMP_TRY(kmp_operating_new(t->system, "start", NULL, &j->start));
    const kmp_backend *backend = kmp_backend_choose(context_of(j), options->backend);
    if (!backend)
        return KEMPE_E_ARGUMENT;
    t->backend = backend->name;
    KMP_TRY(kmp_linear_init(&j->linear, t->system, backend->name));
    if (j->start->chart)
        kmp_eval_set_charts(j->linear.eval, j->start->chart);
    memcpy(j->q, j->start->inner_q, (size_t)n * sizeof *j->q);
    /* Coordinates that move and are not determined by closures keep their rates; rates of rotating ones are found. */
    KMP_TRY(kmp_linear_choose(&j->linear, 0, j->q, NULL, 0));
    for (int k = 0; k < j->linear.p; k++) {
        int c = j->linear.part.u[k];
        bool turns = t->system->model->motions[c].rotation;
        bool state = kmp_state_of(t->system->model, c); /* balanced as at an equilibrium */
        if (!state && j->start->inner_qd[c] != 0 && hold_of(t, c) < 0)
            t->hold[t->hold_count++] = (kmp_steady){.coordinate = c, .how = turns ? KMP_RATE_FREED : KMP_RATE_HELD};
    }
    for (int k = 0; k < t->hold_count; k++)
        t->hold[k].rate = j->start->inner_qd[t->hold[k].coordinate];
    for (int k = 0; k < t->over.count; k++)
        if (t->swept[k].hold >= 0)
            j->here[k] = j->q[t->hold[t->swept[k].hold].coordinate];
    return options->solve_for ? read_freed(j, options->solve_for) : KEMPE_OK;
}

/* -- from value to value --------------------------------------------------------------------------------- */

static kempe_status try_point(job *j, const double *point)
{
    kempe_contacts *t = j->t;
    size_t size = (size_t)t->system->n * sizeof(double);
    kmp_search search = {.rates = t->hold, .rate_count = t->hold_count, .balanced = true, .quiet = true};
    kempe_status status = set_parameters(j, point);
    memcpy(j->before, j->q, size);
    for (int k = 0; k < t->over.count; k++)
        if (t->swept[k].hold >= 0)
            j->q[t->hold[t->swept[k].hold].coordinate] = point[k];
    if (status == KEMPE_OK)
        status = kmp_equilibrium_find(&j->linear, 0, j->q, &search);
    t->iterations += search.iterations;
    if (status == KEMPE_OK) {
        t->residual = fmax(t->residual, search.residual);
        memmove(j->here, point, (size_t)t->over.count * sizeof *point);
    } else {
        memcpy(j->q, j->before, size);
    }
    return status;
}

/* Takes the model assembled with the parameters of a point, as at the start. */
static kempe_status assemble_at(job *j, const double *point)
{
    kmp_operating *start = NULL;
    KMP_TRY(set_parameters(j, point));
    kempe_status status = kmp_operating_new(j->t->system, "start", NULL, &start);
    if (status == KEMPE_OK && start->chart)
        kmp_eval_set_charts(j->linear.eval, start->chart);
    if (status == KEMPE_OK)
        memcpy(j->q, start->inner_q, (size_t)j->t->system->n * sizeof *j->q);
    kmp_operating_free(start);
    return status;
}

/* Finds the state at a point from the assembled model: across a jump of a contact no short step closes the loops. */
static kempe_status begin_again(job *j, const double *point)
{
    const char *reason = kmp_arena_printf(&j->arena, "%s", kempe_context_message(context_of(j)));
    KMP_TRY(kmp_made(context_of(j), reason != NULL));
    kmp_context_clear(context_of(j));
    kempe_status status = assemble_at(j, point);
    if (status == KEMPE_OK)
        status = try_point(j, point);
    if (status != KEMPE_E_FAILED)
        return status;
    kmp_context_clear(context_of(j));
    return kmp_fail(context_of(j), KEMPE_E_FAILED, "%s", reason);
}

/* Goes straight from the current state to `point`, by parts where that is too far. */
static kempe_status go(job *j, const double *point)
{
    kmp_adaptive_substeps parts = KMP_PARTS;
    kempe_status status = KEMPE_OK;
    size_t count = (size_t)j->t->over.count;
    memcpy(j->from, j->here, count * sizeof *j->from);
    double least = memcmp(j->from, point, count * sizeof *point) ? LEAST_PART : 1;
    while (kmp_substeps_next(&parts, least)) {
        for (size_t k = 0; k < count; k++)
            j->between[k] = parts.next < 1 ? j->from[k] + parts.next * (point[k] - j->from[k]) : point[k];
        kmp_context_clear(context_of(j));
        status = try_point(j, j->between);
        if (status != KEMPE_OK && status != KEMPE_E_FAILED)
            return status;
        kmp_substeps_take(&parts, status == KEMPE_OK);
    }
    return status == KEMPE_E_FAILED ? begin_again(j, point) : status;
}

/* Rejects a state at which a run would end, such as off the rails. */
static kempe_status check_ends(job *j)
{
    const kempe_system *s = j->t->system;
    const kmp_linear *l = &j->linear;
    int from = 0;
    const int k = kmp_eval_next_end(l->eval, KMP_ENDS_OF_MODEL, l->t, l->q, l->qd, l->qdd, l->lambda, &from);
    return k < 0 ? KEMPE_OK
                 : kmp_fail(s->context, KEMPE_E_FAILED, "%s: %s", s->event_text[k], s->events.condition[k].advice);
}

/* Largest relative difference of the curvature at the contact from the curvature of the patch, which is an average.
 * Below it the gap is a parabola except for the profile's arcs at its borders. In the benchmark of Manchester it is 3.5
 * % at most for patches that are one ellipse, 9 % at least for others (examples/manchester). */
#define ROUND_ABOUT 0.05

/* A patch from the KMP_CONTACT_SHOWN values of the wheel's output in a zone; its radius from the profile. */
static void fill_patch(const kempe_contacts *t, int wheel, const double *shown, kempe_contact_patch *p)
{
    const kempe_model *model = t->system->model;
    const kmp_wheel *w = &model->wheels[wheel];
    bool touches = shown[3] > 0;
    *p = (kempe_contact_patch){.touches = touches,
                               .s = shown[0],
                               .y = shown[1],
                               .angle = shown[2],
                               .normal = shown[3],
                               .slip = {shown[4], shown[5]},
                               .spin = shown[6],
                               .force = {shown[7], shown[8]},
                               .moment = shown[9],
                               .a = touches ? shown[10] : NAN,
                               .b = touches ? shown[11] : NAN,
                               .one_ellipse = w->form == KMP_CONTACT_RIGID || !touches ? -1
                                              : fabs(shown[12] - 1) <= ROUND_ABOUT     ? 1
                                                                                       : 0,
                               .pressure = NAN,
                               .area = NAN,
                               .approach = NAN};
    p->radius = w->radius.value - kmp_table_value(w->profile->height, 0, p->s);
    kempe_creep creep = {.a = p->a,
                         .b = p->b,
                         .shear_modulus = w->shear_modulus.value,
                         .poisson = w->poisson,
                         .normal = p->normal,
                         .friction = w->friction.value,
                         .slip = {p->slip[0], p->slip[1]},
                         .spin = p->spin};
    kempe_creep_force force = {{0, 0}, 0, 0};
    bool known = !p->touches || t->rolls || kempe_contact_creep(t->law, &creep, &force) == KEMPE_OK;
    for (int k = 0; k < 2; k++)
        p->by_law[k] = t->has_law && known && !t->rolls ? force.force[k] : NAN;
}

/* Takes the patches at the current state. Returns the outputs of the wheels' poses, if there are any. */
static const double *take_patches(job *j, kempe_contact_patch *patch)
{
    const kempe_contacts *t = j->t;
    const kmp_linear *l = &j->linear;
    const double *shown = kmp_eval_shown(l->eval, l->t, l->q, l->qd, l->qdd, l->lambda);
    for (int w = 0; w < t->wheel_count; w++)
        for (int z = t->first[w]; z < t->first[w + 1]; z++)
            fill_patch(t, w, shown + (ptrdiff_t)KMP_CONTACT_SHOWN * z, &patch[z]);
    return shown + (ptrdiff_t)KMP_CONTACT_SHOWN * t->first[t->wheel_count];
}

static kempe_status take_row(job *j)
{
    kempe_contacts *t = j->t;
    const kmp_linear *l = &j->linear;
    KMP_TRY(check_ends(j));
    size_t n = (size_t)t->system->n, row = (size_t)t->count++;
    double *q = t->q + row * n, *qd = t->qd + row * n;
    t->value[row] = j->here[0];
    memcpy(q, l->q, n * sizeof *q);
    memcpy(qd, l->qd, n * sizeof *qd);
    if (t->system->chart_count > 0)
        kmp_charts_show(t->system, l->eval->chart, l->q, q, qd);
    int patches = t->first[t->wheel_count];
    kempe_contact_patch *patch = t->patch + row * (size_t)patches;
    const double *poses = take_patches(j, patch);
    if (t->conicities.count > 0)
        t->conicities.row[row] = kmp_contact_displaced(t, patch, poses);
    for (int w = 0; w < t->wheel_count && t->pressure != KMP_PRESSURE_NONE; w++)
        for (int z = t->first[w]; z < t->first[w + 1]; z++)
            KMP_TRY(kmp_contact_pressure(t, w, z - t->first[w], poses + (ptrdiff_t)KMP_POSE_SHOWN * w, &patch[z],
                                         &t->outline[row * (size_t)patches + (size_t)z]));
    return KEMPE_OK;
}

/* -- jumps between values ---------------------------------------------------------------------------------- */

/* A place in the step to the last row. */
typedef struct place_within {
    double part; /* of the step */
    kmp_displaced at;
} place_within;

/* Adds points between two places until the difference is linear between neighbours, or they are near. */
static kempe_status halve(job *j, const place_within *a, const place_within *b, int halvings)
{
    kmp_conicity_points *found = &j->t->conicities.between[j->t->count - 2];
    place_within middle = {.part = (a->part + b->part) / 2};
    /* Finds the state at a part of the step; the difference is NaN where there is none. */
    kempe_contacts *t = j->t;
    for (int k = 0; k < t->over.count; k++) {
        double from = kmp_range_value(&t->over.range[k], t->count - 2, t->requested);
        j->there[k] = from + middle.part * (kmp_range_value(&t->over.range[k], t->count - 1, t->requested) - from);
    }
    middle.at.difference = NAN;
    kempe_status status = go(j, j->there);
    if (status == KEMPE_OK)
        middle.at = kmp_contact_displaced(t, j->patch, take_patches(j, j->patch));
    KMP_TRY(status == KEMPE_E_FAILED ? KEMPE_OK : status);
    if (isnan(middle.at.difference))
        return KEMPE_OK;
    const double part = (middle.at.aside - a->at.aside) / (b->at.aside - a->at.aside);
    const double line = a->at.difference + part * (b->at.difference - a->at.difference);
    if (halvings >= LEAST_HALVINGS && fabs(line - middle.at.difference) <= STRAIGHT)
        return KEMPE_OK;
    if (halvings < MOST_HALVINGS)
        KMP_TRY(halve(j, a, &middle, halvings + 1));
    if (found->count < KMP_BETWEEN_MOST)
        found->at[found->count++] = middle.at;
    else
        found->cut = true;
    return halvings < MOST_HALVINGS ? halve(j, &middle, b, halvings + 1) : KEMPE_OK;
}

/* Finds points between the last two rows, and returns to the state of the last one. */
static kempe_status find_between(job *j)
{
    kempe_contacts *t = j->t;
    int row = t->count - 2;
    const place_within first = {0, t->conicities.row[row]}, last = {1, t->conicities.row[row + 1]};
    t->conicities.between[row].at = KMP_ARENA_NEW(&t->arena, kmp_displaced, KMP_BETWEEN_MOST);
    KMP_TRY(kmp_made(context_of(j), t->conicities.between[row].at));
    size_t n = (size_t)t->system->n * sizeof(double);
    size_t charts = (size_t)(KMP_CHART_SIZE * t->system->chart_count) * sizeof(double);
    memcpy(j->q_row, j->q, n);
    memcpy(j->chart_row, j->linear.eval->chart, charts);
    kempe_status status = halve(j, &first, &last, 0);
    if (status == KEMPE_OK)
        kmp_context_clear(context_of(j));
    if (t->conicities.between[row].cut)
        kmp_doubt(
            context_of(j),
            "the difference of the radii between rows %d and %d is not resolved by %d places: take more rows there",
            row + 1, row + 2, KMP_BETWEEN_MOST);
    memcpy(j->q, j->q_row, n);
    kmp_eval_set_charts(j->linear.eval, j->chart_row);
    for (int k = 0; k < t->over.count; k++)
        j->here[k] = kmp_range_value(&t->over.range[k], t->count - 1, t->requested);
    return status;
}

static kempe_status run(job *j, const kempe_contact_options *options)
{
    kempe_contacts *t = j->t;
    kempe_status status = begin(j, options);
    for (int row = 0; status == KEMPE_OK && row < t->requested; row++) {
        for (int k = 0; k < t->over.count; k++)
            j->there[k] = kmp_range_value(&t->over.range[k], row, t->requested);
        status = go(j, j->there);
        if (status == KEMPE_OK)
            status = take_row(j);
        if (status == KEMPE_OK && t->conicities.count > 0 && kmp_contact_may_jump(t))
            status = find_between(j);
        kmp_progress(context_of(j), KMP_PROGRESS_STUDY, row + 1, t->requested, "rows");
    }
    /* Keeps a table that is not complete, with its reason. */
    if (t->count == 0 || (status != KEMPE_E_FAILED && status != KEMPE_STOPPED))
        return status;
    t->reason = kmp_arena_printf(&t->arena, "'%s' was swept from %g to %g: %s", t->over.range[0].name, t->value[0],
                                 t->value[t->count - 1],
                                 status == KEMPE_STOPPED ? "interrupted" : kempe_context_message(context_of(j)));
    return t->reason ? KEMPE_STOPPED : kmp_fail_memory(context_of(j));
}

kempe_status kempe_contacts_new(const kempe_system *system, const kempe_contact_options *options,
                                kempe_contacts **table)
{
    KMP_WANTED_BOTH(system, table);
    KMP_OPTIONS(system->context, kempe_contact_options, options);
    double begun = kmp_cpu_now();
    kmp_model_begin(system->model);
    KMP_MAKE(system->context, kempe_contacts, t);
    t->given = system;
    job j = {.t = t};
    kempe_status status = read_request(t, options);
    if (status == KEMPE_OK)
        status = make_system(t);
    if (status == KEMPE_OK)
        status = make_table(t);
    if (status == KEMPE_OK)
        status = run(&j, options);
    kempe_status known = status >= 0 && t->conicities.count > 0 ? kmp_contact_conicity(t) : KEMPE_OK;
    status = known == KEMPE_OK ? status : known;
    kmp_arena_free(&j.arena);
    kmp_operating_free(j.start);
    kmp_linear_free(&j.linear);
    t->status = status = kmp_context_verdict(system->context, status);
    t->warnings = kmp_context_warnings(system->context);
    t->cpu_s = kmp_cpu_now() - begun;
    return KMP_GIVE_IF(status >= 0, status, table, t, kempe_contacts_free);
}

KMP_FREES(kempe_contacts, t, kempe_system_free(t->system), kmp_variant_free(t->variant), kmp_ranges_free(&t->over),
          kmp_arena_free(&t->arena), kmp_free(t->warnings))

/* -- queries ----------------------------------------------------------------------------------------- */

KMP_GETTER(kempe_outcome kempe_contacts_outcome(const kempe_contacts *t), t, kmp_outcome_of(t->status),
           KEMPE_OUTCOME_NONE)
KMP_GETTER(const char *kempe_contacts_reason(const kempe_contacts *t), t, t->reason ? t->reason : "", "")
KMP_GETTER(double kempe_contacts_nonlinearity(const kempe_contacts *t), t,
           t->conicities.count > 0 ? t->conicities.nonlinearity : NAN, NAN)
KMP_GETTER_AT(int kempe_contacts_zone_count(const kempe_contacts *t, int wheel), t, wheel, t->wheel_count,
              t->first[wheel + 1] - t->first[wheel], 0)

const kempe_contact_patch *kempe_contacts_patch(const kempe_contacts *t, int k, int wheel, int zone)
{
    KMP_GIVEN(t, NULL);
    if (k < 0 || k >= t->count || zone < 0 || zone >= kempe_contacts_zone_count(t, wheel))
        return NULL;
    return t->patch + (ptrdiff_t)k * t->first[t->wheel_count] + t->first[wheel] + zone;
}
