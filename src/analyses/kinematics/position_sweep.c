/* SPDX-License-Identifier: BSD-3-Clause */
/* A position study: approaches the beginning of the range from the assembled start, along the range's own line if the
 * start lies on it, then sweeps through it. A dead centre ends the sweep. */
#include "analyses/kinematics/position_sweep.h"
#include "analyses/kinematics/deflections.h"
#include "analyses/kinematics/sweep.h"
#include "analyses/parts/doubted_state.h"
#include "analyses/parts/ranges.h"
#include "base/context.h"
#include "base/memory.h"
#include "constraints/closing/assembly.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/few_tangents.h"
#include "constraints/evaluation/state_ends.h"
#include "constraints/partition/singularity_causes.h"
#include "constraints/tolerances.h"
#include "dynamics/load_dependent.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/language/nearest.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/samples.h"
#include "platform/platform.h"
#include "studies/simulate/flexible_doubts.h"
#include <kempe/check.h>
#include <kempe/kinematics.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* Coordinates with at least this share of the motion in a dead centre could drive on. */
#define SHARE 0.25

/* -- options ------------------------------------------------------------------------------------------ */

/* Reads names and ranges of a sweep: driven coordinates and time, fixed coordinates, and deactivated drives. Driven
 * coordinates are then compared with the degrees of freedom. */

enum { DEFAULT_ROWS = 361, MOST_NAME = 256, MOST_ROWS = 1000000 };

static bool is_coordinate(const kempe_model *model, int k, const char *name)
{
    char numbered[MOST_NAME];
    const kmp_motion *m = &model->motions[k];
    int length = snprintf(numbered, sizeof numbered, "%s.%d", model->bodies[m->body].joint, m->number);
    return strcmp(m->name, name) == 0 || (length > 0 && length < MOST_NAME && strcmp(numbered, name) == 0);
}

/* A drive or lock of the model; -1: none is called so. */
static int find_drive(const kempe_model *model, const char *name)
{
    for (int c = 0; c < model->closure_count; c++)
        if (kmp_closure_is_drive(&model->closures[c]) && strcmp(model->closures[c].name, name) == 0)
            return c;
    return -1;
}

/* Reports an unknown name, with the nearest one. */
static kempe_status refuse_name(const kempe_model *model, const char *name, bool coordinates, const char *word)
{
    kmp_nearest nearest = kmp_nearest_begin(name);
    kmp_text sentence = {0};
    for (int k = 0; coordinates && k < model->motion_count; k++)
        kmp_nearest_offer(&nearest, model->motions[k].name);
    for (int c = 0; c < model->closure_count; c++)
        if (kmp_closure_is_drive(&model->closures[c]))
            kmp_nearest_offer(&nearest, model->closures[c].name);
    kmp_text_printf(&sentence, "'%s' is not a %s of '%s'%s", name, word, model->name, coordinates ? ", and not t" : "");
    kmp_nearest_suggest(&nearest, &sentence);
    return kmp_fail_text(model->context, KEMPE_E_ARGUMENT, &sentence);
}

/* The coordinate of a name, which may be the name of its drive; -1: the time. */
static kempe_status find(const kempe_model *model, const char *name, int *coordinate)
{
    int drive = find_drive(model, name);
    *coordinate = drive >= 0 ? model->closures[drive].motion : -2;
    for (int k = 0; k < model->motion_count; k++)
        if (is_coordinate(model, k, name))
            *coordinate = k;
    if (*coordinate == -2 && strcmp(name, "t") == 0)
        *coordinate = -1;
    return *coordinate == -2 ? refuse_name(model, name, true, "coordinate or drive") : KEMPE_OK;
}

const char *kmp_kinematics_name(const kempe_kinematics *k, const kmp_sweep_parameter *parameter)
{
    return parameter->coordinate < 0 ? "t" : k->system->model->motions[parameter->coordinate].name;
}

const char *kmp_kinematics_unit(const kempe_kinematics *k, const kmp_sweep_parameter *parameter)
{
    return parameter->coordinate < 0 ? "s" : kmp_quantity_unit(k->system, KMP_QUANTITY_Q, parameter->coordinate);
}

static kempe_status add_lead(kempe_kinematics *k, const kmp_range *range)
{
    kempe_context *context = k->system->context;
    const char *name = range->name;
    kmp_sweep_parameter parameter = {0, range->from, range->to};
    KMP_TRY(find(k->system->model, name, &parameter.coordinate));
    if (parameter.coordinate < 0)
        KMP_TRY(kmp_range_fits(context, "sweep", range, KMP_DIM_TIME));
    else
        KMP_TRY(kmp_range_fits_motion(k->system->model, "sweep", range, parameter.coordinate, 0));
    for (int i = 0; i < k->parameter_count; i++)
        if (k->parameter[i].coordinate == parameter.coordinate)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "'%s' is swept or held twice", name);
    if (parameter.coordinate < 0)
        k->time = k->parameter_count;
    k->parameter[k->parameter_count++] = parameter;
    return KEMPE_OK;
}

static kempe_status add_ranges(kempe_kinematics *k, const kmp_ranges *ranges)
{
    for (int i = 0; i < ranges->count; i++)
        KMP_TRY(add_lead(k, &ranges->range[i]));
    k->driven = k->parameter_count;
    for (int i = k->driven - 1; i >= 0; i--)
        if (k->parameter[i].from != k->parameter[i].to)
            k->first = i;
    if (k->first >= 0)
        return KEMPE_OK;
    return kmp_fail(k->system->context, KEMPE_E_ARGUMENT,
                    "nothing is swept: give at least one range between different values, NAME=A:B");
}

/* Deactivates drives and locks of coordinates that the user drives, and those named. */
static kempe_status release(kempe_kinematics *k, int count, char *const *names)
{
    const kempe_model *model = k->system->model;
    for (int c = 0; c < model->closure_count; c++)
        for (int i = 0; i < k->driven; i++)
            if (k->parameter[i].coordinate >= 0 && kmp_closure_is_drive(&model->closures[c]) &&
                model->closures[c].motion == k->parameter[i].coordinate)
                k->released[c] = true;
    for (int i = 0; i < count; i++) {
        int drive = find_drive(model, names[i]);
        if (drive < 0)
            return refuse_name(model, names[i], false, "drive and not a lock");
        k->released[drive] = true;
    }
    return KEMPE_OK;
}

/* "2", "90 deg/s": a rate of the first swept coordinate. */
static kempe_status read_speed(const kempe_kinematics *k, const char *speed, double *value)
{
    kempe_context *context = k->system->context;
    const kmp_sweep_parameter *parameter = &k->parameter[k->first];
    kmp_ranges ranges = {0};
    kmp_text text = {0};
    kmp_text_printf(&text, "%s=%s", kmp_kinematics_name(k, parameter), speed);
    kempe_status status = text.failed ? kmp_fail_memory(context) : kmp_ranges_read(context, text.s, &ranges);
    kmp_text_free(&text);
    const kmp_range *range = ranges.range;
    bool good = status == KEMPE_OK && range && ranges.count == 1 && range->count == 1 && range->from > 0;
    if (status == KEMPE_OK)
        status = good ? kmp_range_fits_motion(k->system->model, "speed", range, parameter->coordinate, 1)
                      : kmp_fail(context, KEMPE_E_ARGUMENT, "speed: one positive value is expected, not '%s'", speed);
    *value = good ? range->from : NAN;
    kmp_ranges_free(&ranges);
    return status;
}

/* The deformations of flexible bodies, unless they are swept or held, keep the deformations of the assembled position,
 * from which they may then move into balance; so do deformations of segments if they do. */
static kempe_status hold_elastic(kempe_kinematics *k, const char *word)
{
    const kempe_model *model = k->system->model;
    const bool *undeformed = model->start.undeformed;
    const int given = k->parameter_count;
    bool any = false;
    k->statics = word && strcmp(word, "static") == 0;
    if (word && !k->statics && strcmp(word, "held") != 0)
        return kmp_fail(model->context, KEMPE_E_ARGUMENT, "elastic: 'held' or 'static' is expected, not '%s'", word);
    for (int i = 0; i < model->motion_count; i++) {
        k->moves[i] = model->motions[i].elastic || (k->statics && undeformed && undeformed[i]);
        for (int p = 0; p < given; p++)
            k->moves[i] = k->moves[i] && k->parameter[p].coordinate != i;
        if (k->moves[i])
            k->parameter[k->parameter_count++] = (kmp_sweep_parameter){.coordinate = i};
        any = any || k->moves[i];
    }
    return any || !k->statics ? KEMPE_OK
                              : kmp_fail(model->context, KEMPE_E_ARGUMENT,
                                         "elastic: 'static' needs a flexible body whose deformations are neither swept "
                                         "nor held");
}

static kempe_status take_all(kempe_kinematics *k, const kempe_kinematics_options *options, const kmp_ranges *ranges)
{
    char **held, **released;
    int hold_count = kmp_text_words(&k->arena, options->hold, &held);
    int release_count = kmp_text_words(&k->arena, options->release, &released);
    k->parameter =
        KMP_ARENA_NEW(&k->arena, kmp_sweep_parameter, ranges->count + hold_count + k->system->model->motion_count);
    k->released = KMP_ARENA_NEW(&k->arena, bool, k->system->model->closure_count);
    k->moves = KMP_ARENA_NEW(&k->arena, bool, k->system->n);
    KMP_TRY(kmp_made(k->system->context, !k->arena.failed));
    KMP_TRY(add_ranges(k, ranges));
    for (int i = 0; i < hold_count; i++) {
        char *name = held[i];
        KMP_TRY(add_lead(k, &(kmp_range){.name = name}));
        if (k->time == k->parameter_count - 1)
            return kmp_fail(k->system->context, KEMPE_E_ARGUMENT, "the time cannot be held: without a sweep it is 0");
    }
    KMP_TRY(hold_elastic(k, options->elastic));
    /* States keep their values: the integrals that represent them move nothing, and rest. */
    const kempe_model *model = k->system->model;
    for (int i = 0; i < model->state_count; i++)
        k->parameter[k->parameter_count++] = (kmp_sweep_parameter){.coordinate = kmp_model_coordinates(model) + i};
    /* One count for all ranges, from whichever gives it. */
    int points = options->points;
    int count = points;
    for (int i = 0; i < ranges->count; i++) {
        int here = ranges->range[i].count;
        if (here < 2)
            continue;
        if (count > 0 && count != here)
            return kmp_fail(k->system->context, KEMPE_E_ARGUMENT,
                            "all ranges are swept together and need the same number of rows, not %d and %d", count,
                            here);
        count = here;
    }
    k->requested = count > 0 ? count : DEFAULT_ROWS;
    if (k->requested < 2 || k->requested > MOST_ROWS)
        return kmp_fail(k->system->context, KEMPE_E_ARGUMENT, "%d rows are not possible: 2 to %d", k->requested,
                        MOST_ROWS);
    const char *speed = options->speed;
    const kmp_sweep_parameter *parameter = &k->parameter[k->first];
    bool timed = k->time >= 0 && k->parameter[k->time].from != k->parameter[k->time].to;
    if (timed && speed)
        return kmp_fail(k->system->context, KEMPE_E_ARGUMENT,
                        "a speed and a range of t exclude each other: the rate of the time is 1");
    k->speed = timed ? NAN : 1;
    KMP_TRY(speed ? read_speed(k, speed, &k->speed) : KEMPE_OK);
    k->rate = timed ? 1 / (k->parameter[k->time].to - k->parameter[k->time].from)
                    : k->speed / fabs(parameter->to - parameter->from);
    return release(k, release_count, released);
}

static kempe_status read_request(kempe_kinematics *k, const kempe_kinematics_options *options)
{
    kmp_ranges ranges;
    k->time = k->first = -1;
    if (!options->sweep || !*options->sweep)
        return kmp_fail(k->system->context, KEMPE_E_ARGUMENT, "the swept coordinate is missing: give 'NAME=A:B'");
    KMP_TRY(kmp_ranges_read(k->system->context, options->sweep, &ranges));
    kempe_status status = take_all(k, options, &ranges);
    kmp_ranges_free(&ranges);
    return status;
}

/* -- check of determinacy ---------------------------------------------------------------------------- */

static kempe_status check_leads(kempe_kinematics *k, kmp_sweep *sweep)
{
    const kempe_model *model = k->system->model;
    int have = 0, follows = -1, p = sweep->p - model->state_count;
    int *order = KMP_ARENA_NEW(&k->arena, int, sweep->n + sweep->p);
    bool *given = KMP_ARENA_NEW(&k->arena, bool, sweep->n);
    kmp_text names = {0};
    KMP_TRY(kmp_made(model->context, !k->arena.failed));
    for (int i = 0; i < k->parameter_count; i++)
        if (k->parameter[i].coordinate >= 0) {
            given[k->parameter[i].coordinate] = true;
            have += !kmp_state_of(model, k->parameter[i].coordinate);
        }
    int rank = kmp_sweep_order(sweep, given, order);
    KMP_TRY(kmp_made(model->context, rank >= 0));
    for (int i = 0; i < rank; i++)
        given[order[i]] = false;
    for (int c = sweep->n - 1; c >= 0; c--)
        follows = given[c] ? c : follows;
    for (int i = rank; i < sweep->p; i++)
        kmp_text_printf(&names, "%s%s", i > rank ? "," : "", model->motions[order[i]].name);
    const char *would = rank < sweep->p ? kmp_text_keep(&names, &k->arena) : "nothing";
    KMP_TRY(kmp_made(model->context, !k->arena.failed));
    if (have > p) {
        if (p == 0)
            return kmp_fail(
                model->context, KEMPE_E_FAILED,
                "the mechanism has no degree of freedom apart from its own drives and locks: sweep one of them "
                "by its name, deactivate one ('--release NAME'), or sweep the time, t=A:B");
        return kmp_fail(model->context, KEMPE_E_FAILED,
                        "the mechanism has %d degree%s of freedom, but %d coordinates are swept or held: %d too many, "
                        "which would contradict the closures",
                        p, p == 1 ? "" : "s", have, have - p);
    }
    if (follows >= 0) {
        const char *name = model->motions[follows].name;
        if (p == 1)
            return kmp_fail(
                model->context, KEMPE_E_FAILED,
                "'%s' cannot be swept from the assembled position: it is at a dead centre, or it cannot move; "
                "use another start ('start:'), or sweep %s",
                name, would);
        return kmp_fail(model->context, KEMPE_E_FAILED,
                        "'%s' is determined by the other swept or held coordinates, or is at a dead centre in the "
                        "assembled position; sweep or hold %s instead",
                        name, would);
    }
    if (have >= p)
        return KEMPE_OK;
    return kmp_fail(model->context, KEMPE_E_FAILED,
                    "the mechanism has %d degree%s of freedom and %d coordinate%s swept or held: sweep or hold %d "
                    "more, for instance %s ('--hold %s' keeps %s as assembled)",
                    p, p == 1 ? "" : "s", have, have == 1 ? " is" : "s are", p - have, would, would,
                    p - have == 1 ? "it" : "them");
}

/* -- outputs ----------------------------------------------------------------------------------------- */

/* An output that there are columns of. */
static bool is_shown(const kempe_model *model, int output)
{
    const kmp_output *o = &model->outputs[output];
    if (kmp_output_width(model, o) == 0 || kmp_output_has_loads(model, o))
        return false;
    for (int k = 0; k < output; k++)
        if (kmp_output_equal(&model->outputs[k], o))
            return false;
    return true;
}

static kempe_status make_room(kempe_kinematics *k)
{
    /* The columns of all outputs of positions. */
    const kempe_model *model = k->system->model;
    k->column = KMP_ARENA_NEW(&k->arena, kmp_shown_column, kmp_outputs_width(model));
    for (int o = 0, at = 0; o < model->output_count; o++) {
        int width = kmp_output_width(model, &model->outputs[o]);
        for (int c = 0; k->column && c < width && is_shown(model, o); c++) {
            kmp_text name = {0};
            kmp_output_column(&name, model, &model->outputs[o], c);
            k->column[k->width++] = (kmp_shown_column){o, c, at + c, kmp_text_keep(&name, &k->arena)};
        }
        at += width;
    }
    ptrdiff_t rows = k->requested, size = rows * k->system->n;
    KMP_TRY(kmp_made(k->system->context, KMP_ARENA_MAKE(&k->arena, KMP_ROOM(double, size, &k->q, &k->qd, &k->qdd),
                                                        KMP_ROOM(double, rows, &k->requested_s, &k->s),
                                                        KMP_ROOM(double, rows * k->width, &k->shown))));
    for (int i = 0; i < k->requested; i++)
        k->requested_s[i] = i == k->requested - 1 ? 1 : (double)i / (k->requested - 1);
    return KEMPE_OK;
}

/* -- results of the sweep ---------------------------------------------------------------------------- */

typedef struct job {
    kempe_kinematics *k;
    kempe_assembly *assembly;
    kmp_sweep sweep;
    double *zero;                 /* m multipliers */
    double *start;                /* n: the swept coordinates' assembled values */
    kmp_deflections *deflections; /* NULL: deformations are held */
    const char *lost;             /* why they have no balance, NULL: they have; and where */
    double lost_at;
    kmp_text reason;
} job;

static void show(job *j, double s, const double *q, const double *qd, const double *qdd, double *out)
{
    const kempe_kinematics *k = j->k;
    double t = k->time < 0 ? 0 : kmp_sweep_parameter_value(&k->parameter[k->time], s);
    const double at = k->width > 0 ? kmp_eval_row_time(j->sweep.eval, t, q, qd) : t;
    const double *all = k->width > 0 ? kmp_eval_shown(j->sweep.eval, at, q, qd, qdd, j->zero) : NULL;
    kmp_eval_doubt_state(j->sweep.eval, t, q, qd, qdd, j->zero, false, true, all);
    for (int c = 0; c < k->width; c++)
        out[c] = all[k->column[c].at];
}

static bool is_timed(const kempe_kinematics *k)
{
    return k->time >= 0 && k->parameter[k->time].from != k->parameter[k->time].to;
}

/* The row `at` with deformations in balance, from the deformations of the row before, and its derivatives by s. False:
 * it has none. */
static bool balance_row(job *j, size_t at, double s, const double *qs)
{
    kempe_kinematics *k = j->k;
    const size_t n = (size_t)k->system->n;
    double *q = k->q + at * n;
    for (size_t i = 0; at > 0 && i < n; i++)
        q[i] = k->moves[i] ? k->q[(at - 1) * n + i] : q[i];
    const kmp_sweep_parameter *time = is_timed(k) ? &k->parameter[k->time] : NULL;
    if (qs)
        memcpy(k->qd + at * n, qs, n * sizeof *qs);
    if (qs && kmp_deflections_at(j->deflections, time ? kmp_sweep_parameter_value(time, s) : 0,
                                 time ? time->to - time->from : 0, q, k->qd + at * n, k->qdd + at * n))
        return true;
    j->lost = qs ? "the flexible bodies find no balance with their loads: one of them may buckle"
                 : "the swept coordinates determine no deformations at a dead centre";
    j->lost_at = s;
    return false;
}

static void take_row(void *user, double s, const double *q, const double *qs, const double *qss)
{
    job *j = user;
    kempe_kinematics *k = j->k;
    size_t at = (size_t)k->count, n = (size_t)k->system->n;
    double rate = k->rate, *qd = k->qd + at * n, *qdd = k->qdd + at * n;
    memcpy(k->q + at * n, q, n * sizeof *q);
    if (j->lost || (j->deflections && !balance_row(j, at, s, qs)))
        return;
    if (j->deflections)
        q = k->q + at * n;
    k->count++;
    k->s[at] = s;
    for (size_t i = 0; i < n; i++) {
        const kmp_state *state = kmp_state_of(k->system->model, (int)i);
        const double slope = j->deflections ? qd[i] : qs ? qs[i] : NAN;
        const double curvature = j->deflections ? qdd[i] : qss ? qss[i] : NAN;
        qd[i] = state ? k->system->model->start.qd[i].value : slope * rate;
        qdd[i] = state ? 0 : curvature * rate * rate;
    }
    show(j, s, q, qd, qdd, k->shown + at * (size_t)k->width);
    kmp_progress(k->system->context, KMP_PROGRESS_STUDY, k->count, k->requested, "rows");
}

static void take_change(void *user, const kmp_sweep_pose *pose, double margin)
{
    job *j = user;
    kempe_kinematics *k = j->k;
    size_t n = (size_t)k->system->n;
    if (j->deflections && !j->lost) {
        j->lost = "deformations in balance are not followed through a change point";
        j->lost_at = pose->x[n];
    }
    kmp_change_point *more = kmp_realloc(k->change, (size_t)k->change_count + 1, sizeof *more);
    double *q = KMP_ARENA_NEW(&k->arena, double, n);
    k->change = more ? more : k->change;
    k->arena.failed = k->arena.failed || !more;
    if (!k->arena.failed)
        k->change[k->change_count++] = (kmp_change_point){pose->x[n], margin, memcpy(q, pose->x, n * sizeof *q)};
}

/* -- dead centres ------------------------------------------------------------------------------------ */

static double speed_here(const job *j, int coordinate)
{
    return fabs(j->sweep.here.dx[coordinate]) / j->sweep.unit[coordinate];
}

/* Coordinates that move most there, the best first. */
static char *list_instead(const job *j)
{
    const kempe_system *s = j->k->system;
    kmp_text text = {0};
    int count = 0, *best = KMP_ARENA_NEW(&j->k->arena, int, s->n);
    for (int c = 0; best && c < s->n; c++) {
        bool swept = false;
        for (int i = 0; i < j->k->parameter_count; i++)
            swept = swept || j->k->parameter[i].coordinate == c;
        if (swept || speed_here(j, c) <= SHARE * kmp_sweep_fastest(&j->sweep, &j->sweep.here))
            continue;
        int at = count++;
        for (; at > 0 && speed_here(j, best[at - 1]) < speed_here(j, c); at--)
            best[at] = best[at - 1];
        best[at] = c;
    }
    for (int k = 0; k < count; k++)
        kmp_text_printf(&text, "%s%s", k ? ", " : "", s->model->motions[best[k]].name);
    return kmp_text_keep(&text, &j->k->arena);
}

static double s_here(const job *j)
{
    return j->sweep.here.x[j->sweep.n];
}

static double value_here(const job *j, const kmp_sweep_parameter *parameter)
{
    return parameter->coordinate < 0 ? kmp_sweep_parameter_value(parameter, s_here(j))
                                     : j->sweep.here.x[parameter->coordinate];
}

/* Stores the current state as a dead centre; `up`: s was increasing. */
static kempe_status take_dead(job *j, bool up)
{
    kempe_kinematics *k = j->k;
    kmp_sweep_pose *here = &j->sweep.here;
    const kmp_sweep_parameter *parameter = &k->parameter[k->first];
    size_t n = (size_t)k->system->n;
    double *nothing = KMP_ARENA_NEW(&k->arena, double, n), *still = KMP_ARENA_NEW(&k->arena, double, n);
    kmp_dead_centre *dead = &k->dead[k->dead_count++];
    *dead = (kmp_dead_centre){.s = s_here(j),
                              .value = value_here(j, parameter),
                              .largest = up == (parameter->to > parameter->from),
                              .determined = kmp_sweep_hold(&j->sweep, here),
                              .margin = kmp_sweep_margin(&j->sweep, here),
                              .instead = list_instead(j),
                              .q = KMP_ARENA_NEW(&k->arena, double, n),
                              .shown = KMP_ARENA_NEW(&k->arena, double, k->width)};
    KMP_TRY(kmp_made(k->system->context, !k->arena.failed));
    memcpy(dead->q, here->x, n * sizeof *here->x);
    for (int i = kmp_model_coordinates(k->system->model); i < k->system->n; i++)
        still[i] = k->system->model->start.qd[i].value;
    show(j, dead->s, here->x, still, nothing, dead->shown);
    return KEMPE_OK;
}

/* -- the path ---------------------------------------------------------------------------------------- */

static void say_dead(job *j, int d)
{
    const kempe_kinematics *k = j->k;
    const kmp_dead_centre *dead = &k->dead[d];
    kmp_shown as = kmp_shown_as(k->system->context, kmp_kinematics_unit(k, &k->parameter[k->first]));
    int moving = 0;
    for (int i = 0; i < k->parameter_count; i++)
        moving += k->parameter[i].from != k->parameter[i].to;
    kmp_text_printf(&j->reason, "%sdead centre: %s'%s' becomes no %s than %.6g %s on this branch",
                    j->reason.length ? "; " : "", moving > 1 ? "the swept coordinates cannot continue together: " : "",
                    kmp_kinematics_name(k, &k->parameter[k->first]), dead->largest ? "larger" : "smaller",
                    as.factor * dead->value, as.unit);
    if (k->first == k->time)
        kmp_text_put(&j->reason, ", where the prescribed motion locks");
    if (*dead->instead)
        kmp_text_printf(&j->reason, "; alternative driving coordinates: %s", dead->instead);
}

static kempe_status end_of(job *j, kmp_sweep_end end)
{
    if (end == KMP_SWEEP_NO_MEMORY || j->k->arena.failed)
        return kmp_fail_memory(j->k->system->context);
    if (end == KMP_SWEEP_LOST) {
        const kempe_kinematics *k = j->k;
        const kmp_sweep_parameter *parameter = &k->parameter[k->first];
        const kmp_sweep_pose *here = &j->sweep.here;
        kmp_shown as = kmp_shown_as(k->system->context, kmp_kinematics_unit(k, parameter));
        const double margin = kmp_sweep_margin(&j->sweep, here);
        kmp_text_printf(&j->reason, "the sweep cannot pass %s = %.9g %s: ", kmp_kinematics_name(k, parameter),
                        as.factor * value_here(j, parameter), as.unit);
        if (margin < KMP_MARGIN_ENTRY)
            kmp_text_printf(&j->reason, "the position is nearly singular (%.1e)", margin);
        else
            kmp_text_put(&j->reason, "the position changes abruptly, within the shortest step of a sweep");
        kmp_angles_explain(k->system->model, here->x, &j->reason);
        return KEMPE_E_FAILED;
    }
    if (j->lost) {
        const kmp_sweep_parameter *parameter = &j->k->parameter[j->k->first];
        kmp_shown as = kmp_shown_as(j->k->system->context, kmp_kinematics_unit(j->k, parameter));
        kmp_text_printf(&j->reason, "at %s = %.9g %s %s", kmp_kinematics_name(j->k, parameter),
                        as.factor * kmp_sweep_parameter_value(parameter, j->lost_at), as.unit, j->lost);
        return KEMPE_E_FAILED;
    }
    if (end != KMP_SWEEP_INTERRUPTED)
        return KEMPE_OK;
    kmp_text_put(&j->reason, "interrupted");
    return KEMPE_STOPPED;
}

/* The s of the driven coordinates on their own line. False: they are not on it. */
static bool on_line(const job *j, double *s)
{
    const kempe_kinematics *k = j->k;
    const kmp_sweep_parameter *first = &k->parameter[k->first];
    *s = (j->start[k->first] - first->from) / (first->to - first->from);
    for (int i = 0; i < k->parameter_count; i++)
        if (i != k->first && (k->parameter[i].from != k->parameter[i].to || k->parameter[i].from != j->start[i]))
            return false;
    return true;
}

/* The given driven values apply from s on. */
static kempe_status sweep_to(job *j, const kmp_sweep_parameter *parameters, double s)
{
    const kempe_kinematics *k = j->k;
    kempe_status status = kmp_sweep_along(&j->sweep, k->parameter_count, parameters, s);
    return status != KEMPE_E_FAILED ? status
                                    : kmp_fail(k->system->context, status,
                                               "at the beginning of the sweep the other coordinates do not follow from "
                                               "the swept ones: a dead centre of '%s'",
                                               kmp_kinematics_name(k, &k->parameter[k->first]));
}

/* Goes to s_end, with `rows` rows on the path. */
static kempe_status go(job *j, double s_end, int rows, kmp_sweep_end *end)
{
    kempe_kinematics *k = j->k;
    const kmp_sweep_task task = {s_end, rows, k->requested_s + k->begin, take_row, take_change, j};
    *end = kmp_sweep_go(&j->sweep, &task);
    if (rows == 0)
        k->change_count = 0; /* outside the range, or reported again in the other direction */
    return end_of(j, *end);
}

/* Approaches A from the assembled state, along a separate line. */
static kempe_status approach_aside(job *j)
{
    kempe_kinematics *k = j->k;
    kmp_sweep_parameter *path = KMP_ARENA_NEW(&k->arena, kmp_sweep_parameter, k->parameter_count);
    kmp_sweep_end end;
    bool moves = false;
    KMP_TRY(kmp_made(k->system->context, path));
    for (int i = 0; i < k->parameter_count; i++) {
        path[i] = (kmp_sweep_parameter){k->parameter[i].coordinate, j->start[i], k->parameter[i].from};
        moves = moves || path[i].from != path[i].to;
    }
    if (!moves)
        return KEMPE_OK;
    KMP_TRY(sweep_to(j, path, 0));
    KMP_TRY(go(j, 1, 0, &end));
    if (end == KMP_SWEEP_DEAD)
        return kmp_fail(k->system->context, KEMPE_E_FAILED,
                        "the beginning of the ranges cannot be reached from the assembled position: there is a dead "
                        "centre at '%s' = %.9g before it",
                        kmp_kinematics_name(k, &k->parameter[k->first]), value_here(j, &k->parameter[k->first]));
    if (s_here(j) == 1)
        return KEMPE_OK;
    return kmp_fail(k->system->context, KEMPE_E_FAILED,
                    "the beginning of the ranges is a change point, where branches meet: use another beginning");
}

/* Approaches A along the line of the range itself; where that ends in a dead centre within the range, the rows begin
 * there. */
static kempe_status approach_along(job *j, double s)
{
    kempe_kinematics *k = j->k;
    kmp_sweep_end end;
    KMP_TRY(sweep_to(j, k->parameter, s));
    KMP_TRY(go(j, 0, 0, &end));
    if (end != KMP_SWEEP_DEAD)
        return KEMPE_OK;
    KMP_TRY(take_dead(j, s < 0));
    while (k->begin < k->requested && k->requested_s[k->begin] < s_here(j) - 1e-12)
        k->begin++;
    bool reached = s > 0 && k->begin < k->requested;
    if (k->begin > 0 || !reached)
        say_dead(j, 0);
    return reached ? KEMPE_OK : KEMPE_E_FAILED;
}

static kempe_status follow(job *j)
{
    double s;
    if (!on_line(j, &s)) {
        KMP_TRY(approach_aside(j));
        s = 0;
    }
    KMP_TRY(s != 0 ? approach_along(j, s) : sweep_to(j, j->k->parameter, 0));
    kempe_kinematics *k = j->k;
    int rows = k->requested - k->begin;
    kmp_sweep_end end;
    KMP_TRY(go(j, 1, rows, &end));
    if (end == KMP_SWEEP_DEAD) {
        KMP_TRY(take_dead(j, true));
        if (k->count < rows)
            say_dead(j, k->dead_count - 1);
    }
    return k->count < k->requested ? KEMPE_STOPPED : KEMPE_OK;
}

/* -- the study --------------------------------------------------------------------------------------- */

static kempe_status begin_balance(job *j, kmp_deflections *deflections)
{
    kempe_kinematics *k = j->k;
    const kempe_system *s = k->system;
    bool *driven = KMP_ARENA_NEW(&k->arena, bool, s->n), *left_out = KMP_ARENA_NEW(&k->arena, bool, s->m);
    KMP_TRY(kmp_made(s->context, !k->arena.failed));
    for (int i = 0; i < k->parameter_count; i++)
        if (k->parameter[i].coordinate >= 0)
            driven[k->parameter[i].coordinate] = true;
    for (int r = 0; r < s->m; r++)
        left_out[r] = k->released[s->rows[r].closure];
    if (is_timed(k) && kmp_equations_move_in_time(s))
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "a sweep of t with 'elastic static' does not support forces or directions of closures that "
                        "depend on time or inputs: sweep coordinates instead, at t = 0");
    j->deflections = deflections;
    return kmp_deflections_init(deflections, s,
                                &(kmp_deformation_choice){.moves = k->moves,
                                                          .liked = driven,
                                                          .left_out = left_out,
                                                          .rests = true,
                                                          .q = j->assembly->q,
                                                          .qd = j->assembly->qd});
}

static const double *row_of(const void *kinematics, int row)
{
    const kempe_kinematics *k = kinematics;
    return k->q + (ptrdiff_t)row * k->system->n;
}

static kempe_status run(job *j, const kempe_kinematics_options *options, kmp_deflections *deflections)
{
    kempe_kinematics *k = j->k;
    const kempe_system *s = k->system;
    const kmp_backend *backend = kmp_backend_choose(s->context, options->backend);
    if (!backend)
        return KEMPE_E_ARGUMENT;
    k->backend = backend->name;
    KMP_TRY(kmp_assembly_at_start(s, &j->assembly));
    j->zero = KMP_ARENA_NEW(&k->arena, double, s->m);
    j->start = KMP_ARENA_NEW(&k->arena, double, k->parameter_count);
    KMP_TRY(kmp_made(s->context, !k->arena.failed));
    KMP_TRY(kmp_sweep_init(&j->sweep, s, k->backend, k->released));
    /* Sweeps from the assembled state q. */
    const double *q = j->assembly->q;
    for (int i = 0; i < k->parameter_count; i++) {
        int c = k->parameter[i].coordinate;
        j->start[i] = c < 0 ? 0 : q[c];
        if (i >= k->driven)
            k->parameter[i].from = k->parameter[i].to = q[c];
    }
    const bool timed = is_timed(k);
    const kmp_sweep_parameter from_zero = {-1, 0, timed ? k->parameter[k->time].to : 0};
    KMP_TRY(kmp_sweep_stand(&j->sweep, 0, q));
    KMP_TRY(check_leads(k, &j->sweep));
    if (k->statics)
        KMP_TRY(begin_balance(j, deflections));
    if (timed)
        KMP_TRY(kmp_sweep_let_move(&j->sweep, &from_zero, 0, q));
    return follow(j);
}

static kempe_status finish(job *j, kempe_status status)
{
    kempe_kinematics *k = j->k;
    k->effort = j->sweep.effort;
    k->status = status;
    kmp_sweep_free(&j->sweep);
    kempe_assembly_free(j->assembly);
    if (j->reason.length == 0)
        return status;
    if (status == KEMPE_E_FAILED && !j->reason.failed)
        (void)kmp_fail(k->system->context, status, "%s", j->reason.s);
    k->reason = kmp_text_keep(&j->reason, &k->arena);
    return k->reason ? status : kmp_fail_memory(k->system->context);
}

kempe_status kempe_kinematics_new(const kempe_system *system, const kempe_kinematics_options *options,
                                  kempe_kinematics **kinematics)
{
    KMP_WANTED_BOTH(system, kinematics);
    KMP_OPTIONS(system->context, kempe_kinematics_options, options);
    (options->elastic ? kmp_model_begin_forces : kmp_model_begin)(system->model);
    KMP_TRY(kmp_refuse_contacts(system->model, "kinematics"));
    double begin = kmp_cpu_now();
    KMP_MAKE(system->context, kempe_kinematics, k);
    k->system = system;
    kmp_deflections deflections = {.unstable = false};
    job j = {.k = k};
    kempe_status status = read_request(k, options);
    if (status == KEMPE_OK)
        status = make_room(k);
    if (status == KEMPE_OK)
        status = finish(&j, run(&j, options, &deflections));
    /* Rows with deformations in balance are not trusted where these are large or not stable. */
    if (j.deflections && j.deflections->unstable)
        kmp_doubt(system->context,
                  "deformations are in balance with their loads, but not in a stable one: a flexible body "
                  "buckles under less than these");
    kmp_doubt_deflections(system, k->count, row_of, k);
    kmp_deflections_free(&deflections);
    status = kmp_context_verdict(system->context, status);
    k->status = status == KEMPE_UNTRUSTED ? status : k->status;
    k->cpu_s = kmp_cpu_now() - begin;
    k->warnings = kmp_context_warnings(system->context);
    bool something = k->count > 0 || k->dead_count > 0; /* reported even after a failure */
    return KMP_GIVE_IF(status >= 0 || (status == KEMPE_E_FAILED && something), status, kinematics, k,
                       kempe_kinematics_free);
}

KMP_FREES(kempe_kinematics, k, kmp_free(k->warnings), kmp_free(k->change), kmp_arena_free(&k->arena))

/* -- queries ----------------------------------------------------------------------------------------- */

KMP_GETTER(kempe_outcome kempe_kinematics_outcome(const kempe_kinematics *k), k, kmp_outcome_of(k->status),
           KEMPE_OUTCOME_NONE)
KMP_GETTER(const char *kempe_kinematics_reason(const kempe_kinematics *k), k, k->reason ? k->reason : "", "")
