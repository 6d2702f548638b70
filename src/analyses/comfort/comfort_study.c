/* SPDX-License-Identifier: BSD-3-Clause */
/* The study of ride comfort: a run, its accelerations at equal steps of time, and what they are worth; as a report and
 * as one JSON object. */
#include "analyses/comfort/comfort_study.h"
#include "base/memory.h"
#include "base/quantile.h"
#include "constraints/tolerances.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/result_table.h"
#include "output/start_balance.h"
#include "pipeline.h"
#include "studies/simulate/trajectory.h"
#include <kempe/output_handles.h>
#include <math.h>
#include <string.h>

static const double USUAL_RATE = 1000, LEAST_RATE = 400, LARGEST_RATE = 20000;

const kmp_comfort_row kmp_comfort_rows[KMP_COMFORT_DIRECTIONS] = {
    [KMP_COMFORT_LONGITUDINAL] = {"longitudinal", KMP_WEIGHTING_WD, false},
    [KMP_COMFORT_LATERAL] = {"lateral", KMP_WEIGHTING_WD, true},
    [KMP_COMFORT_VERTICAL] = {"vertical", KMP_WEIGHTING_WB, true},
    [KMP_COMFORT_SEAT_BACK] = {"seat back", KMP_WEIGHTING_WC, false},
    [KMP_COMFORT_SEAT] = {"seat", KMP_WEIGHTING_WK, false}};

/* The outputs of all signals, in the order of the signals. */
typedef struct study {
    kempe_comfort *c;
    kempe_context *context;
    kempe_trajectory *run;
    const kempe_comfort_options *options;
    const char *words[KMP_COMFORT_DIRECTIONS];
    kempe_outputs *outputs[KMP_COMFORT_DIRECTIONS];
    double start;                   /* of the run, s */
    int samples, before, window;    /* of the run; before the windows; in a window */
    double *row, *value, *weighted; /* of an instant; samples of a signal after the samples of another; of one signal */
} study;

/* -- signals ------------------------------------------------------------------------------------------ */

/* Accelerations that the model requests are vertical along z where gravity is, or where wheels run. */
static kempe_status choose_words(study *s)
{
    static const kmp_comfort_direction along[] = {KMP_COMFORT_LONGITUDINAL, KMP_COMFORT_LATERAL, KMP_COMFORT_VERTICAL};
    const kempe_comfort_options *o = s->options;
    const kempe_model *model = s->c->system->model;
    const char *const given[KMP_COMFORT_DIRECTIONS] = {o->longitudinal, o->lateral, o->vertical, o->seat_back, o->seat};
    kmp_text list[3] = {{0}, {0}, {0}};
    memcpy(s->words, given, sizeof given);
    for (int k = 0; k < KMP_COMFORT_DIRECTIONS; k++)
        if (given[k])
            return KEMPE_OK;
    bool upright = model->gravity[2].value != 0 || model->wheel_count > 0;
    for (int k = 0; k < model->output_count && upright; k++)
        for (int axis = 0; model->outputs[k].kind == KMP_OUTPUT_ACCELERATION && axis < 3; axis++) {
            kmp_text_put(&list[axis], list[axis].length > 0 ? "," : "");
            kmp_output_print(&list[axis], model, &model->outputs[k]);
            kmp_text_printf(&list[axis], ".%c", "xyz"[axis]);
        }
    for (int axis = 0; axis < 3; axis++)
        s->words[along[axis]] = kmp_text_keep(&list[axis], &s->c->arena);
    KMP_TRY(kmp_made(s->context, !s->c->arena.failed));
    if (!s->words[KMP_COMFORT_VERTICAL] || !*s->words[KMP_COMFORT_VERTICAL])
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "no acceleration output found: the model requests none of a point, with z upwards; give "
                        "--vertical, --seat, --lateral or --longitudinal, for example 'acceleration(BODY.POINT).z'");
    return KEMPE_OK;
}

static int count_words(const char *words)
{
    int count = 0;
    for (const char *at = words, *end; *at; at = end) {
        int depth = 0;
        for (end = at; *end && (depth > 0 || *end != ','); end++)
            depth += (*end == '(') - (*end == ')');
        count += end > at;
        end += *end == ',';
    }
    return count;
}

static kempe_status check_signals(study *s, kmp_comfort_direction d)
{
    const kempe_outputs *o = s->outputs[d];
    if (kempe_outputs_count(o) != count_words(s->words[d]))
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "%s: '%s' has %d values: give one component of each output, such as "
                        "'acceleration(BODY.POINT).z'",
                        kmp_comfort_rows[d].name, s->words[d], kempe_outputs_count(o));
    for (int k = 0; k < kempe_outputs_count(o); k++) {
        const char *unit = kempe_outputs_unit(o, k);
        if (*unit && strcmp(unit, "m/s^2") != 0)
            return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                            "%s: '%s' has the unit %s; an acceleration in m/s^2 is needed", kmp_comfort_rows[d].name,
                            kempe_outputs_name(o, k), unit);
    }
    return KEMPE_OK;
}

/* The k-th signal of a direction; NULL: there are fewer. */
static const kmp_comfort_signal *signal_of(const kempe_comfort *c, kmp_comfort_direction direction, int k)
{
    for (int i = 0; i < c->count; i++)
        if (c->signal[i].direction == direction && k-- == 0)
            return &c->signal[i];
    return NULL;
}

static kempe_status make_signals(study *s)
{
    kempe_comfort *c = s->c;
    KMP_TRY(choose_words(s));
    for (int d = 0; d < KMP_COMFORT_DIRECTIONS; d++)
        if (s->words[d] && *s->words[d]) {
            KMP_TRY(kempe_outputs_new(c->system, s->words[d], &s->outputs[d]));
            KMP_TRY(check_signals(s, (kmp_comfort_direction)d));
            c->count += kempe_outputs_count(s->outputs[d]);
        }
    c->signal = KMP_ARENA_NEW(&c->arena, kmp_comfort_signal, c->count);
    for (int d = 0, n = 0; c->signal && d < KMP_COMFORT_DIRECTIONS; d++)
        for (int k = 0; k < kempe_outputs_count(s->outputs[d]); k++)
            c->signal[n++] =
                (kmp_comfort_signal){.direction = (kmp_comfort_direction)d,
                                     .name = kmp_arena_strdup(&c->arena, kempe_outputs_name(s->outputs[d], k))};
    while (signal_of(c, KMP_COMFORT_LONGITUDINAL, c->places) && signal_of(c, KMP_COMFORT_LATERAL, c->places) &&
           signal_of(c, KMP_COMFORT_VERTICAL, c->places))
        c->places++;
    return kmp_made(s->context, !c->arena.failed);
}

/* -- samples ------------------------------------------------------------------------------------------ */

static kempe_status check_times(study *s)
{
    kempe_comfort *c = s->c;
    const kempe_comfort_options *o = s->options;
    double end, length;
    c->rate = o->rate > 0 ? o->rate : USUAL_RATE;
    if (!s->run->recording || !kmp_recording_ends(s->run->recording, &s->start, &end))
        return kmp_fail(s->context, KEMPE_E_ARGUMENT, "the run has rows only: set keep_dense to evaluate its comfort");
    c->from = fmax(o->from, s->start);
    length = end - c->from;
    if (o->rate != 0 && !(o->rate >= LEAST_RATE && o->rate <= LARGEST_RATE))
        return kmp_fail(s->context, KEMPE_E_ARGUMENT,
                        "the rate of samples is %g per second; it must be between %g and %g, because weightings reach "
                        "to 100 Hz",
                        o->rate, LEAST_RATE, LARGEST_RATE);
    c->windows = (int)floor(length / KMP_COMFORT_WINDOW + KMP_WINDOW_SLACK);
    if (!(o->from >= 0) || c->windows < 1)
        return kmp_fail(
            s->context, KEMPE_E_ARGUMENT,
            "comfort is evaluated in windows of %g s, but the run has %.6g s from t = %.6g s on: a longer run "
            "is needed (--t-end)",
            KMP_COMFORT_WINDOW, length, c->from);
    s->window = 2 * (int)lround(KMP_COMFORT_WINDOW * c->rate / 2); /* even, for every other sample */
    s->before = 2 * (int)lround((c->from - s->start) * c->rate / 2);
    s->samples = s->before + c->windows * s->window + 1;
    return KEMPE_OK;
}

static kempe_status take_samples(study *s)
{
    kempe_comfort *c = s->c;
    double end;
    (void)kmp_recording_ends(s->run->recording, &s->start, &end);
    for (int k = 0; k < s->samples; k++) {
        double t = fmin(s->start + k / c->rate, end);
        for (int d = 0, signal = 0; d < KMP_COMFORT_DIRECTIONS; d++) {
            int count = kempe_outputs_count(s->outputs[d]);
            if (count > 0)
                KMP_TRY(kempe_outputs_at_time(s->outputs[d], s->run, t, s->row));
            for (int i = 0; i < count; i++)
                s->value[(ptrdiff_t)signal++ * s->samples + k] = s->row[i];
        }
        if (kmp_interrupted(s->context))
            return kmp_fail(s->context, KEMPE_STOPPED, "interrupted at t = %.6g s of the samples", t);
    }
    return KEMPE_OK;
}

/* The velocities of the signals of a direction that an impact at t changes, in s->row. Room: 4 n, and the signals.
 * *size: the largest jump of a rate, as a velocity. */
static kempe_status find_jumps(study *s, int direction, double t, double *room, double *size)
{
    const kempe_system *system = s->c->system;
    const int n = system->n;
    double *q = room, *qd = q + n, *after = qd + n, *jump = after + n, *still = jump + n;
    KMP_TRY(kempe_trajectory_at_time(s->run, nextafter(t, INFINITY), NULL, after, NULL, NULL));
    KMP_TRY(kempe_trajectory_at_time(s->run, t, q, qd, NULL, NULL));
    *size = 0;
    for (int i = 0; i < n; i++) {
        jump[i] = after[i] - qd[i];
        *size = fmax(*size, system->length * fabs(jump[i]) / system->scale[i]);
    }
    /* Accelerations are linear in qdd. */
    KMP_TRY(kempe_outputs_at_state(s->outputs[direction], t, q, qd, NULL, NULL, still));
    KMP_TRY(kempe_outputs_at_state(s->outputs[direction], t, q, qd, jump, NULL, s->row));
    for (int i = 0; i < kempe_outputs_count(s->outputs[direction]); i++)
        s->row[i] -= still[i];
    return KEMPE_OK;
}

/* An impact changes velocities at once: no sample of an acceleration has that. */
static kempe_status doubt_impacts(study *s)
{
    const kmp_run_log *log = &s->run->log;
    const double until = s->start + (s->samples - 1) / s->c->rate;
    const kmp_comfort_signal *signal = s->c->signal;
    double *room = KMP_NEW(double, 4 * s->c->system->n + s->c->count + 1);
    kempe_status status = kmp_made(s->context, room);
    for (int d = 0; d < KMP_COMFORT_DIRECTIONS; signal += kempe_outputs_count(s->outputs[d++])) {
        const int count = kempe_outputs_count(s->outputs[d]);
        bool doubted = count == 0;
        for (int k = 0; k < log->kept && status == KEMPE_OK && !doubted; k++) {
            const kmp_log_entry *e = &log->entries[k];
            double size;
            if (strcmp(e->kind, "impact") != 0 || !(e->t >= s->c->from && e->t < until))
                continue;
            status = find_jumps(s, d, e->t, room, &size);
            for (int i = 0; i < count && status == KEMPE_OK && !doubted; i++) {
                doubted = fabs(s->row[i]) > KMP_COMFORT_JUMP * size;
                if (doubted)
                    kmp_doubt(s->context,
                              "comfort: an impact changes the velocity of '%s' by %.3g m/s at t = %.6g s, which no "
                              "acceleration has: give the contact a 'law'",
                              signal[i].name, s->row[i], e->t);
            }
        }
    }
    kmp_free(room);
    return status;
}

/* -- numbers ------------------------------------------------------------------------------------------ */

/* The numbers of a signal from samples with a stride. */
static kempe_status judge_samples(study *s, const double *value, int stride, double *window, kmp_comfort_signal *out)
{
    int samples = (s->samples - 1) / stride + 1, before = s->before / stride, size = s->window / stride;
    int windows = s->c->windows, count = windows * size;
    double rate = s->c->rate / stride, *w = s->weighted;
    const kmp_comfort_row *row = &kmp_comfort_rows[out->direction];
    double *own = s->weighted + s->samples, *ordered = s->weighted + 2 * (ptrdiff_t)s->samples;
    for (int k = 0; k < samples; k++)
        own[k] = value[(ptrdiff_t)k * stride];
    KMP_TRY(kmp_made(s->context, kmp_weight(row->weighting, rate, samples, own, w)));
    for (int k = 0; k < windows; k++)
        window[k] = ordered[k] = kmp_root_mean_square(size, w + before + (ptrdiff_t)k * size);
    kmp_order(windows, ordered);
    out->raw = kmp_root_mean_square(count, own + before);
    out->weighted = kmp_root_mean_square(count, w + before);
    out->median = kmp_ordered_quantile(windows, ordered, 0.5);
    out->percentile = kmp_ordered_quantile(windows, ordered, 0.95);
    out->largest = ordered[windows - 1];
    out->sperling =
        row->sperling ? kmp_sperling(out->direction == KMP_COMFORT_VERTICAL, rate, count, own + before) : NAN;
    return KEMPE_OK;
}

/* Wz of a ride that passengers do not feel is 1. */
static double relative(double a, double b, double least)
{
    double size = fmax(fabs(a), least);
    return isfinite(a) && size > 0 ? fabs(a - b) / size : 0;
}

static kempe_status judge_signal(study *s, int k)
{
    kmp_comfort_signal *out = &s->c->signal[k], half = *out;
    const double *value = s->value + (ptrdiff_t)k * s->samples;
    double *unused = s->weighted + 2 * (ptrdiff_t)s->samples + s->c->windows;
    out->window = KMP_ARENA_NEW(&s->c->arena, double, s->c->windows);
    KMP_TRY(kmp_made(s->context, out->window));
    KMP_TRY(judge_samples(s, value, 2, unused, &half));
    KMP_TRY(judge_samples(s, value, 1, out->window, out));
    const double changes[] = {relative(out->raw, half.raw, 0),         relative(out->weighted, half.weighted, 0),
                              relative(out->median, half.median, 0),   relative(out->percentile, half.percentile, 0),
                              relative(out->largest, half.largest, 0), relative(out->sperling, half.sperling, 1)};
    for (size_t i = 0; i < sizeof changes / sizeof *changes; i++)
        out->difference = fmax(out->difference, changes[i]);
    if (out->difference > KMP_COMFORT_HOLDS)
        kmp_doubt(
            s->context,
            "comfort: with every other sample a value of '%s' differs by %.1f %%: give a larger --rate, now %g per "
            "second",
            out->name, 100 * out->difference, s->c->rate);
    return KEMPE_OK;
}

static kempe_status judge(study *s)
{
    kempe_comfort *c = s->c;
    kmp_arena room = {0};
    KMP_TRY(check_times(s));
    bool quiet = kmp_context_quiet(s->context, true); /* outputs have no separate warnings */
    kempe_status status = make_signals(s);
    bool made = KMP_ARENA_MAKE(&room, KMP_ROOM(double, c->count + 1, &s->row),
                               KMP_ROOM(double, (ptrdiff_t)c->count * s->samples, &s->value),
                               KMP_ROOM(double, 2 * ((ptrdiff_t)s->samples + c->windows), &s->weighted));
    if (status == KEMPE_OK)
        status = kmp_made(s->context, made);
    if (status == KEMPE_OK)
        status = take_samples(s);
    (void)kmp_context_quiet(s->context, quiet);
    if (status == KEMPE_OK)
        status = doubt_impacts(s);
    for (int k = 0; status == KEMPE_OK && k < c->count; k++)
        status = judge_signal(s, k);
    kmp_arena_free(&room);
    return status;
}

/* -- the study ---------------------------------------------------------------------------------------- */

kempe_status kempe_comfort_new(const kempe_system *system, const kempe_comfort_options *options,
                               kempe_comfort **comfort)
{
    KMP_WANTED_BOTH(system, comfort);
    KMP_OPTIONS(system->context, kempe_comfort_options, options);
    const kempe_run_options *run = options->run;
    KMP_OPTIONS(system->context, kempe_run_options, run);
    KMP_TRY(kmp_run_options_check(system->context, run, KMP_STUDY_COMFORT));
    kmp_model_begin_forces(system->model);
    KMP_MAKE(system->context, kempe_comfort, c);
    c->system = system;
    kempe_run_options dense = *run;
    kempe_trajectory *trajectory = NULL;
    dense.size = sizeof dense;
    dense.keep_dense = 1;
    kempe_status status = kmp_simulate(system, &dense, &trajectory);
    study s = {.c = c, .context = system->context, .run = trajectory, .options = options};
    if (status == KEMPE_OK)
        status = judge(&s);
    else if (status == KEMPE_STOPPED && !kmp_interrupted(system->context))
        status = kmp_fail(system->context, KEMPE_E_FAILED, "the run stops before its end: %s",
                          kempe_trajectory_reason(trajectory));
    for (int d = 0; d < KMP_COMFORT_DIRECTIONS; d++)
        kempe_outputs_free(s.outputs[d]);
    if (trajectory && status == KEMPE_OK)
        status = kmp_made(system->context, kmp_start_balance_copy(&c->arena, trajectory->balance, &c->balance));
    kempe_trajectory_free(trajectory);
    c->warnings = kmp_context_warnings(system->context);
    c->status = status = kmp_context_verdict(system->context, status);
    return KMP_GIVE_OR_FREE(status, comfort, c, kempe_comfort_free);
}

KMP_FREES(kempe_comfort, c, kmp_free(c->warnings), kmp_arena_free(&c->arena))

KMP_GETTER(int kempe_comfort_place_count(const kempe_comfort *comfort), comfort, comfort->places, 0)

static double mean_comfort(const kempe_comfort *c, int place)
{
    double sum = 0;
    for (int d = KMP_COMFORT_LONGITUDINAL; d <= KMP_COMFORT_VERTICAL; d++) {
        double a = signal_of(c, (kmp_comfort_direction)d, place)->percentile;
        sum += a * a;
    }
    return 6 * sqrt(sum);
}

KMP_GETTER_AT(double kempe_comfort_mean_comfort(const kempe_comfort *comfort, int place), comfort, place,
              comfort->places, mean_comfort(comfort, place), NAN)

/* -- tables ------------------------------------------------------------------------------------------- */

static void fill_signals(kempe_table *table, const void *result)
{
    const kempe_comfort *c = result;
    kmp_tabulate_columns(table,
                         "direction[words] name[words] weighting[words] rms[m/s^2] weighted[m/s^2] median[m/s^2] "
                         "percentile_95[m/s^2] largest[m/s^2] Wz difference");
    for (int k = 0; k < c->count; k++) {
        const kmp_comfort_signal *s = &c->signal[k];
        const kmp_comfort_row *row = &kmp_comfort_rows[s->direction];
        KMP_TABULATE(table, "%s %s %s %g %g %g %g %g %g %g", row->name, s->name, kmp_weighting_name(row->weighting),
                     s->raw, s->weighted, s->median, s->percentile, s->largest, s->sperling, s->difference);
    }
}

static void fill_windows(kempe_table *table, const void *result)
{
    const kempe_comfort *c = result;
    kmp_tabulate_columns(table, "t[s]");
    for (int k = 0; k < c->count; k++)
        kmp_tabulate_column(table, "m/s^2", "%s.%s",
                            kmp_weighting_name(kmp_comfort_rows[c->signal[k].direction].weighting), c->signal[k].name);
    for (int w = 0; w < c->windows; w++) {
        kmp_tabulate_row(table);
        kmp_tabulate_number(table, c->from + KMP_COMFORT_WINDOW * (w + 1));
        for (int k = 0; k < c->count; k++)
            kmp_tabulate_number(table, c->signal[k].window[w]);
    }
}

KMP_TABLES(kempe_comfort, comfort, comfort->system->context, {"signals", fill_signals}, {"windows", fill_windows})

/* -- output ------------------------------------------------------------------------------------------------- */

static double worst(const kempe_comfort *c)
{
    double difference = 0;
    for (int k = 0; k < c->count; k++)
        difference = fmax(difference, c->signal[k].difference);
    return difference;
}

enum { NAME_AT = 70 };

/* The answer: mean comfort where three directions are known, otherwise the largest Wz or the largest 95 % value. */
static void show_title(kmp_text *text, const kempe_comfort *c)
{
    const kmp_shown as = kmp_shown_as(c->system->context, "m/s^2");
    kmp_text title = {0};
    int place = 0;
    double wz = NAN, percentile = 0;
    for (int k = 1; k < c->places; k++)
        if (kempe_comfort_mean_comfort(c, k) > kempe_comfort_mean_comfort(c, place))
            place = k;
    for (int k = 0; k < c->count; k++) {
        wz = fmax(wz, c->signal[k].sperling);
        percentile = fmax(percentile, c->signal[k].percentile);
    }
    kmp_print_title(&title, c->system->model, kmp_outcome_of(c->status));
    if (c->places > 0)
        kmp_text_printf(&title, "%smean comfort N_MV %.3f at '%s'", c->places > 1 ? "largest " : "",
                        kempe_comfort_mean_comfort(c, place), signal_of(c, KMP_COMFORT_VERTICAL, place)->name);
    else if (isfinite(wz))
        kmp_text_printf(&title, "ride comfort: largest Wz %.3f", wz);
    else
        kmp_text_printf(&title, "ride comfort: largest 95 %% value %.4f %s", as.factor * percentile, as.unit);
    kmp_text_printf(&title, ", t = %.6g to %.6g s", c->from, c->from + c->windows * KMP_COMFORT_WINDOW);
    kmp_print_answer(text, &title, kmp_outcome_of(c->status), c->warnings, "", NULL);
    kmp_start_balance_show(text, c->balance);
}

static void show(kmp_text *text, const void *result)
{
    const kempe_comfort *c = result;
    const kmp_shown as = kmp_shown_as(c->system->context, "m/s^2");
    const double factor = as.factor;
    show_title(text, c);
    kmp_text_printf(text, "\n  %-15s%9s%9s%9s%9s%9s%7s  of\n", as.unit, "rms", "weighted", "median", "95 %", "largest",
                    "Wz");
    for (int k = 0; k < c->count; k++) {
        const kmp_comfort_signal *s = &c->signal[k];
        const kmp_comfort_row *row = &kmp_comfort_rows[s->direction];
        kmp_text_printf(text, "  %-12s %-2s", row->name, kmp_weighting_name(row->weighting));
        kmp_print_cells(text, "%9.4f%9.4f%9.4f%9.4f%9.4f%7.3f", factor * s->raw, factor * s->weighted,
                        factor * s->median, factor * s->percentile, factor * s->largest, s->sperling);
        kmp_text_printf(text, "%s  %s\n", NAME_AT + strlen(s->name) > KMP_PRINT_LINE ? "\n" : "", s->name);
    }
    for (int k = 0; k < c->places && c->places > 1; k++)
        kmp_text_printf(text, "  mean comfort N_MV %.3f at '%s'\n", kempe_comfort_mean_comfort(c, k),
                        signal_of(c, KMP_COMFORT_VERTICAL, k)->name);
    kmp_text_printf(text, "\n  %d window%s of %g s", c->windows, c->windows == 1 ? "" : "s", KMP_COMFORT_WINDOW);
    if (c->windows < KMP_COMFORT_WINDOWS)
        kmp_text_printf(text, "; EN 12299 takes %d windows, 5 min", KMP_COMFORT_WINDOWS);
    kmp_text_printf(text, "\n  %g samples per second; with half of them values differ by at most %.2g of them\n",
                    c->rate, worst(c));
}

void kmp_comfort_json(kmp_json *json, const kempe_comfort *c)
{
    kmp_json_put(json, "from %g windows %d window %g rate %g difference %g signals [", c->from, c->windows,
                 KMP_COMFORT_WINDOW, c->rate, worst(c));
    for (int k = 0; k < c->count; k++) {
        const kmp_comfort_signal *s = &c->signal[k];
        const kmp_comfort_row *row = &kmp_comfort_rows[s->direction];
        kmp_json_put(json, "{ direction %s name %s weighting %s rms %g weighted %g", row->name, s->name,
                     kmp_weighting_name(row->weighting), s->raw, s->weighted);
        kmp_json_put(json, "median %g percentile_95 %g largest %g Wz %g difference %g", s->median, s->percentile,
                     s->largest, s->sperling, s->difference);
        kmp_json_numbers(json, "windows", c->windows, s->window);
        kmp_json_end(json);
    }
    kmp_json_put(json, "] mean_comfort [");
    for (int k = 0; k < c->places; k++)
        kmp_json_number(json, NULL, kempe_comfort_mean_comfort(c, k));
    kmp_json_put(json, "]");
}

static void json_all(kmp_text *text, const void *result)
{
    const kempe_comfort *c = result;
    kmp_json json = kmp_print_head(text, c->system, kmp_outcome_of(c->status), "", 0, c->warnings);
    kmp_start_balance_json(&json, c->balance);
    kmp_comfort_json(&json, c);
    kmp_json_end(&json);
}

KMP_PRINT(kempe_comfort, comfort, comfort->system->context, json_all, show)
