/* SPDX-License-Identifier: BSD-3-Clause */
/* Simulating: options to a run, a run to a trajectory. */
#include "studies/simulate/trajectory.h"
#include "base/file.h"
#include "base/memory.h"
#include "base/wings.h"
#include "constraints/closing/assembly.h"
#include "constraints/closing/mode_watch.h"
#include "constraints/diagnosis/shared_loads.h"
#include "constraints/evaluation/evaluator.h"
#include "constraints/evaluation/present_inputs.h"
#include "constraints/evaluation/validity.h"
#include "constraints/partition/undetermined_loads.h"
#include "integrators/run/methods.h"
#include "integrators/steppers/sample_times.h"
#include "model/data/coordinates.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/read/loads.h"
#include "output/print.h"
#include "output/start_balance.h"
#include "studies/simulate/flexible_doubts.h"
#include "studies/simulate/lift_off.h"
#include "studies/simulate/reaction_watch.h"
#include "studies/simulate/run_remarks.h"
#include <inttypes.h>
#include <kempe/check.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* -- checkpoints ----------------------------------------------------------------------------------------- */

/* Checkpoints of a long run, from which it can continue: a line that identifies the model, a line of columns, the rows
 * in full digits, the past of continuous delays, why the run is not to be trusted so far, and a checksum of these. */

enum { VERSION = 5, PIECE_HEAD = 3 };

/* 64-bit FNV-1a (Fowler, Noll, Vo): any one byte that differs changes it. */
static uint64_t hash_more(uint64_t hash, const char *s, size_t length)
{
    for (size_t i = 0; i < length; i++)
        hash = (hash ^ (unsigned char)s[i]) * 0x100000001b3u;
    return hash;
}

static uint64_t hash_of(const char *s, size_t length)
{
    return hash_more(0xcbf29ce484222325u, s, length);
}

void kmp_checkpoint_end(kmp_text *text, const char *s, size_t length)
{
    kmp_text_printf(text, "# end, %016" PRIx64 "\n", hash_of(s, length));
}

static int width_of(const kempe_system *system, kmp_quantity quantity)
{
    return quantity == KMP_QUANTITY_LAMBDA ? system->m : system->n;
}

/* The head of a checkpoint: the model's own text, with the values of its parameters, identifies it; the text without
 * the start shows where only this differs. */
kempe_status kmp_checkpoint_head(const kempe_system *system, kmp_text *text)
{
    char *model = NULL;
    KMP_TRY(kempe_model_print(system->model, KEMPE_JSON, &model));
    /* The line of the start in a model's own text, and its end; a text without one ends there. */
    static const char head[] = "\n\"start\":";
    const char *line = strstr(model, head);
    const char *end = line ? line + strcspn(line + 1, "\n") + 1 : model + strlen(model);
    const char *start = line ? line : end;
    const uint64_t rest = hash_more(hash_of(model, (size_t)(start - model)), end, strlen(end));
    kmp_text_printf(text, "# kempe checkpoint %d, model %s, %016" PRIx64 ", start %016" PRIx64 "\nt,work", VERSION,
                    kempe_model_name(system->model), rest, hash_of(start, (size_t)(end - start)));
    kempe_text_free(model);
    for (kmp_quantity k = KMP_QUANTITY_Q; k < KMP_QUANTITIES; k++)
        for (int i = 0; i < width_of(system, k); i++)
            kmp_text_printf(text, ",%s.%s", kmp_quantity_prefix(k), kmp_quantity_name(system, k, i));
    kmp_text_put(text, "\n");
    return KEMPE_OK;
}

/* Each delayed signal: its delay and the number of its polynomials; then these: from, to, the order of the derivative
 * that jumps at its beginning, coefficients. Pieces that ended before the delay before t are not needed. */
static void print_past(const kmp_past_signal *signal, double t, kmp_text *text)
{
    int first = 0;
    while (first + 1 < signal->count && signal->piece[first + 1].from <= t - signal->delay &&
           !kmp_same_time(signal->piece[first + 1].from, t - signal->delay))
        first++;
    kmp_text_put(text, "# past,");
    kmp_text_number(text, signal->delay);
    kmp_text_printf(text, ",%d\n", signal->count - first);
    for (const kmp_past_piece *piece = signal->piece + first; piece < signal->piece + signal->count; piece++) {
        const double head[] = {piece->from, piece->to, piece->jump};
        for (int i = 0; i < PIECE_HEAD + KMP_PAST_DEGREE + 1; i++) {
            kmp_text_put(text, i > 0 ? "," : "");
            kmp_text_number(text, i < PIECE_HEAD ? head[i] : piece->c[i - PIECE_HEAD]);
        }
        kmp_text_put(text, "\n");
    }
}

static const char doubt_head[] = "# doubt,";

/* Doubts of a run, one a line. A run that continues from the checkpoint has them, too. */
static void print_doubts(const char *doubts, kmp_text *text)
{
    static const char before[] = KMP_BEFORE_CHECKPOINT;
    for (const char *line = doubts; *line; line += strcspn(line, "\n") + 1)
        kmp_text_printf(text, "%s%s%.*s\n", doubt_head, strncmp(line, before, sizeof before - 1) == 0 ? "" : before,
                        (int)strcspn(line, "\n"), line);
}

/* Whole or not at all. With a past of delayed signals (NULL: there are none), the rows until its end. */
static kempe_status checkpoint_write(const kempe_system *system, const kmp_samples *samples, const kmp_past *past,
                                     const char *doubts, const char *path)
{
    kmp_text text = {0};
    double t = 0;
    KMP_TRY(kmp_checkpoint_head(system, &text));
    for (int row = 0; row < samples->rows; row++) {
        double at = kmp_samples_time(samples, row);
        if (past && at > past->known && !kmp_same_time(at, past->known))
            break;
        kmp_text_number(&text, kmp_samples_time(samples, row));
        kmp_text_put(&text, ",");
        kmp_text_number(&text, kmp_samples_work(samples, row));
        for (kmp_quantity k = KMP_QUANTITY_Q; k < KMP_QUANTITIES; k++) {
            const double *value = kmp_samples_get(samples, k, row);
            for (int i = 0; i < width_of(system, k); i++) {
                kmp_text_put(&text, ",");
                kmp_text_number(&text, value[i]);
            }
        }
        kmp_text_put(&text, "\n");
        t = at;
    }
    for (int k = 0; past && k < past->count; k++)
        print_past(&past->signal[k], t, &text);
    print_doubts(doubts, &text);
    if (!text.failed)
        kmp_checkpoint_end(&text, text.s, text.length);
    return kmp_file_write(system->context, path, &text);
}

/* -- reading ----------------------------------------------------------------------------------------- */

/* 0: no checkpoint. */
static long version_of(const char *text)
{
    static const char head[] = "# kempe checkpoint ";
    return strncmp(text, head, sizeof head - 1) == 0 ? strtol(text + sizeof head - 1, NULL, 10) : 0;
}

static size_t read_number(const char *s, double *value)
{
    size_t minus = *s == '-', length = kmp_text_to_number(s + minus, value);
    if (minus)
        *value = -*value;
    return length ? length + minus : 0;
}

/* Reads one line of `count` numbers into `values`; returns the column of an error, 0 when there is none. */
static int read_line(const char *line, const char *end, int count, double *values)
{
    const char *s = line;
    for (int k = 0; k < count; k++) {
        size_t length = read_number(s, &values[k]);
        if (length == 0 || !isfinite(values[k]) || s[length] != (k + 1 < count ? ',' : '\n'))
            return (int)(s - line) + 1;
        s += length + (k + 1 < count);
    }
    return s == end ? 0 : (int)(s - line) + 1;
}

/* A file under way. */
typedef struct reading {
    const kempe_system *system;
    const char *path, *s; /* the rest */
    int line;
} reading;

static kempe_status next_line(reading *r, int count, double *values)
{
    const char *end = strchr(r->s, '\n');
    int column = end ? read_line(r->s, end, count, values) : 1;
    if (column)
        return kmp_complain(r->system->context, r->path, r->line, column, "a row of %d numbers is expected", count);
    r->s = end + 1;
    r->line++;
    return KEMPE_OK;
}

static kempe_status read_rows(reading *r, double *row, kmp_samples *samples)
{
    const int n = r->system->n, count = 2 + 3 * n + r->system->m;
    while (*r->s && *r->s != '#') {
        KMP_TRY(next_line(r, count, row));
        if (samples->rows && row[0] <= kmp_samples_time(samples, samples->rows - 1))
            return kmp_complain(r->system->context, r->path, r->line - 1, 1, "the times must increase");
        const double *q = row + 2;
        if (kmp_samples_add(samples, row[0], q, q + n, q + 2 * n, q + 3 * n, row[1]))
            return kmp_fail_memory(r->system->context);
    }
    if (samples->rows == 0)
        return kmp_complain(r->system->context, r->path, r->line, 1,
                            "the checkpoint has no rows: there is no state to continue from");
    return KEMPE_OK;
}

/* The polynomials of a signal follow each other, from the delay before t or earlier until t or later. */
static kempe_status read_past(reading *r, double t, kmp_past_signal *signal)
{
    static const char head[] = "# past,";
    double number[PIECE_HEAD + KMP_PAST_DEGREE + 1] = {0};
    const int line = r->line;
    bool follows = strncmp(r->s, head, sizeof head - 1) == 0;
    r->s += follows ? sizeof head - 1 : 0;
    if (follows)
        KMP_TRY(next_line(r, 2, number));
    signal->delay = number[0];
    follows = follows && signal->delay > 0;
    for (double left = number[1]; follows && left >= 1; left--) {
        KMP_TRY(next_line(r, PIECE_HEAD + KMP_PAST_DEGREE + 1, number));
        kmp_past_piece *last = signal->piece ? &signal->piece[signal->count - 1] : NULL;
        follows = number[0] < number[1] && (last ? number[0] == last->to : number[0] <= t - signal->delay) &&
                  number[2] >= 0 && number[2] <= KMP_PAST_SMOOTH;
        kmp_past_piece *room = kmp_list_room(signal->piece, (size_t)signal->count, sizeof *room);
        KMP_TRY(kmp_made(r->system->context, room));
        signal->piece = room;
        room[signal->count] =
            (kmp_past_piece){.from = number[0], .to = number[1], .jump = follows ? (int)number[2] : 0};
        memcpy(room[signal->count++].c, number + PIECE_HEAD, sizeof room->c);
    }
    double end = follows && signal->count > 0 ? signal->piece[signal->count - 1].to : -INFINITY;
    if (end >= t || kmp_same_time(end, t))
        return KEMPE_OK;
    return kmp_complain(r->system->context, r->path, line, 1,
                        "the past of a continuous delay until the last row, t = %.9g s, is expected", t);
}

static kempe_status read_pasts(reading *r, double t, kmp_past **past)
{
    const int count = r->system->model->delay_count;
    kempe_status status = KEMPE_OK;
    kmp_past *read = count > 0 ? kmp_past_new(count) : NULL;
    if (count > 0)
        KMP_TRY(kmp_made(r->system->context, read));
    for (int k = 0; status == KEMPE_OK && k < count; k++) {
        status = read_past(r, t, &read->signal[k]);
        if (status == KEMPE_OK)
            read->known = fmax(k > 0 ? read->known : t, read->signal[k].piece[read->signal[k].count - 1].to);
    }
    return KMP_GIVE_OR_FREE(status, past, read, kmp_past_free);
}

static kempe_status read_doubts(reading *r)
{
    while (strncmp(r->s, doubt_head, sizeof doubt_head - 1) == 0) {
        const char *line = r->s + sizeof doubt_head - 1;
        const size_t length = strcspn(line, "\n");
        if (length == 0 || line[length] != '\n')
            break;
        kmp_doubt(r->system->context, "%.*s", (int)length, line);
        r->s = line + length + 1;
        r->line++;
    }
    return *r->s ? kmp_complain(r->system->context, r->path, r->line, 1, "the checksum is expected here") : KEMPE_OK;
}

/* Cuts the last line off, which must be the sum of the rest. */
static kempe_status check_end(const kempe_system *system, const char *path, char *text, size_t length)
{
    size_t at = length > 0 ? length - 1 : 0;
    int line = 1;
    kmp_text end = {0};
    while (at > 0 && text[at - 1] != '\n')
        at--;
    for (size_t i = 0; i < at; i++)
        line += text[i] == '\n';
    kmp_checkpoint_end(&end, text, at);
    bool whole =
        !end.failed && strlen(text) == length && end.length == length - at && memcmp(end.s, text + at, end.length) == 0;
    kempe_status status = end.failed ? kmp_fail_memory(system->context)
                          : whole    ? KEMPE_OK
                                     : kmp_complain(system->context, path, line, 1,
                                                    "the checkpoint is damaged: its last line is not the checksum of the "
                                                       "lines before it; continue from another one");
    text[at] = '\0';
    kmp_text_free(&end);
    return status;
}

/* The length of the first line up to the hash of the start. */
static size_t length_to_start(const char *head)
{
    static const char hash[] = "0123456789abcdef\n";
    const size_t line = strcspn(head, "\n") + 1;
    return line > sizeof hash - 1 ? line - (sizeof hash - 1) : 0;
}

static kempe_status read_text(const kempe_system *system, const char *path, const char *text, kmp_samples *samples,
                              kmp_past **past)
{
    const long version = version_of(text);
    kmp_text head = {0};
    double *row = KMP_NEW(double, 2 + 3 * system->n + system->m);
    kempe_status status = row ? kmp_checkpoint_head(system, &head) : kmp_fail_memory(system->context);
    if (status == KEMPE_OK && (head.failed || !head.s))
        status = kmp_fail_memory(system->context);
    if (status == KEMPE_OK && version == 0)
        status = kmp_complain(system->context, path, 1, 1, "this is not a checkpoint of a run");
    else if (status == KEMPE_OK && version != VERSION)
        status = kmp_complain(system->context, path, 1, 1,
                              "the checkpoint has format %ld, this version reads format %d: run from the start",
                              version, VERSION);
    else if (status == KEMPE_OK && head.s && strncmp(text, head.s, length_to_start(head.s)) == 0 &&
             strncmp(text, head.s, strcspn(head.s, "\n") + 1) != 0)
        status = kmp_complain(system->context, path, 1, 1,
                              "the checkpoint is of this model from another start: give the start that it has (--at, "
                              "--set), or run from the start");
    else if (status == KEMPE_OK && head.s && strncmp(text, head.s, head.length) != 0)
        status = kmp_complain(
            system->context, path, 1, 1,
            "the checkpoint is of another model, or the model has changed since; its first line must be: %.*s",
            (int)strcspn(head.s, "\n"), head.s);
    reading r = {system, path, text + head.length, 3};
    if (status == KEMPE_OK)
        status = read_rows(&r, row, samples);
    if (status == KEMPE_OK)
        status = read_pasts(&r, kmp_samples_time(samples, samples->rows - 1), past);
    if (status == KEMPE_OK)
        status = read_doubts(&r);
    kmp_text_free(&head);
    kmp_free(row);
    return status;
}

kempe_status kmp_checkpoint_read(const kempe_system *system, const char *path, kmp_samples *samples, kmp_past **past)
{
    char *text;
    size_t length;
    kmp_samples read;
    KMP_TRY(kmp_file_read(system->context, KMP_FILE_CHECKPOINT, path, &text, &length));
    kmp_samples_init(&read, system->n, system->m);
    kempe_status status = version_of(text) == VERSION ? check_end(system, path, text, length) : KEMPE_OK;
    if (status == KEMPE_OK)
        status = read_text(system, path, text, &read, past);
    kmp_free(text);
    if (status == KEMPE_OK) {
        kmp_samples_free(samples);
        *samples = read;
    } else {
        kmp_samples_free(&read);
    }
    return status;
}

/* -- simulating ------------------------------------------------------------------------------------------- */

enum { CHECKPOINT_SECONDS = 10 };
/* Machine code for the judgement of fewer rows takes longer to write than the tape to run, which has the same bits. */
enum { MANY_ROWS = 200 };

/* Bytes of the dense output from which running safety is judged: the memory of some minutes of a vehicle. */
#define DENSE_OF_WHEELS 5e8

/* Fewer rows do not show what energy is exchanged between them, unless it is by work: the error may then be more of
 * what they show. */
#define FEW_ROWS    20
#define OF_FEW_ROWS 0.05
/* Times the tolerances; forms that let positions drift keep it. */
#define TRUSTED_GAP 1e4

/* -- options ----------------------------------------------------------------------------------------- */

static kempe_status check_numbers(kempe_context *context, const kempe_run_options *run)
{
    const struct {
        const char *name;
        double value;
    } numbers[] = {
#define KMP_RUN_OPTION(name, type, ...) KMP_RUN_IF_NUMBER_##type({#name, (double)run->name}, )
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    };
    for (size_t k = 0; k < sizeof numbers / sizeof *numbers; k++)
        if (!(numbers[k].value >= 0) || !isfinite(numbers[k].value))
            return kmp_fail(context, KEMPE_E_ARGUMENT, "%s = %g: a positive number is expected", numbers[k].name,
                            numbers[k].value);
    if (run->threads < 0 || run->threads > KMP_TEAM_MOST)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "%d threads: 1 to %d are possible", run->threads, KMP_TEAM_MOST);
    return KEMPE_OK;
}

static const char *studies_of(unsigned studies)
{
    static const struct {
        unsigned study;
        const char *words;
    } names[] = {{KMP_STUDY_COMFORT, "ride comfort does"},
                 {KMP_STUDY_STEPPER, "steppers do"},
                 {KMP_STUDY_HISTORY, "histories do"},
                 {KMP_STUDY_ENSEMBLE, "ensembles do"},
                 {KMP_STUDY_SENSITIVITY, "sensitivities do"},
                 {KMP_STUDY_STATE, "sensitivities of a state do"},
                 {KMP_STUDY_FLOW, "flows do"},
                 {KMP_STUDY_FIT, "fits do"},
                 {KMP_STUDY_OPTIMUM, "optimisations do"},
                 {KMP_STUDY_CYCLES, "limit cycles do"}};
    const char *words = "runs do";
    for (size_t k = 0; k < sizeof names / sizeof *names; k++)
        words = names[k].study & studies ? names[k].words : words;
    return words;
}

kempe_status kmp_run_options_check(kempe_context *context, const kempe_run_options *run, unsigned studies)
{
    enum {
        OF_SIMULATION = KMP_STUDY_SIMULATION,
        OF_COMFORT = KMP_STUDY_COMFORT,
        OF_STEPPER = KMP_STUDY_STEPPER,
        OF_ENSEMBLE = KMP_STUDY_ENSEMBLE,
        OF_HISTORY = KMP_STUDY_HISTORY,
        OF_SENSITIVITY = KMP_STUDY_SENSITIVITY,
        OF_STATE = KMP_STUDY_STATE,
        OF_FIT = KMP_STUDY_FIT,
        OF_OPTIMUM = KMP_STUDY_OPTIMUM,
        OF_RUNS = KMP_STUDY_SIMULATION | KMP_STUDY_COMFORT | KMP_STUDY_STEPPER | KMP_STUDY_ENSEMBLE | KMP_STUDY_HISTORY,
        OF_ALL = OF_RUNS | KMP_STUDY_SENSITIVITY | KMP_STUDY_FLOW | KMP_STUDY_FIT | KMP_STUDY_OPTIMUM | KMP_STUDY_CYCLES
    };
    const struct {
        const char *name;
        bool given;
        unsigned studies;
    } options[] = {
#define KMP_RUN_OPTION(name, type, key, engine, folder, studies, ...) {#name, run->name != 0, studies},
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    };
    for (size_t k = 0; k < sizeof options / sizeof *options; k++)
        if (options[k].given && !(options[k].studies & studies))
            return kmp_fail(context, KEMPE_E_ARGUMENT, "%s not take the option '%s': leave it out", studies_of(studies),
                            options[k].name);
    return KEMPE_OK;
}

kempe_status kmp_spec_of(const kempe_system *system, const kempe_run_options *run, kmp_arena *arena, kmp_run_spec *spec)
{
    int *u = KMP_ARENA_NEW(arena, int, system->n), count = 0;
    KMP_TRY(check_numbers(system->context, run));
    KMP_TRY(kmp_made(system->context, u));
    KMP_TRY(kmp_coordinates_read(system->model, "independent", run->independent, u, &count));
    *spec = (kmp_run_spec){.u = count > 0 ? u : NULL, .u_count = count};
#define KMP_RUN_OPTION(name, type, key, engine, ...) KMP_RUN_IF_RUN_##engine(spec->name = run->name;)
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    return kmp_run_resolve(system, spec);
}

void kmp_spec_numbers(const kmp_run_spec *spec, kempe_run_options *run)
{
#define KMP_RUN_OPTION(name, type, key, engine, ...)                                                                   \
    KMP_RUN_IF_RUN_##engine(KMP_RUN_IF_NUMBER_##type(run->name = spec->name;))
#include "model/data/run_options.def"
#undef KMP_RUN_OPTION
    run->integrator = spec->integrator;
}

static kempe_status read_peaks(kmp_simulation *j)
{
    kmp_text complaint = {0};
    const char *word = j->run->reaction_peaks;
    const kmp_reaction_peaks where =
        word ? kmp_reaction_peaks_find(word, &complaint) : j->system->model->run.reaction_peaks;
    j->watches = where == KMP_REACTION_PEAKS_MOTION || j->system->model->bearing_count > 0;
    if (where == KMP_REACTION_PEAKS_COUNT)
        return kmp_fail_text(j->context, KEMPE_E_ARGUMENT, &complaint);
    return KEMPE_OK;
}

static kempe_status read_options(kmp_simulation *j)
{
    KMP_TRY(kmp_spec_of(j->system, j->run, &j->arena, &j->spec));
    KMP_TRY(kmp_load_share_read(j->context, j->run->loads, &j->least_norm));
    KMP_TRY(read_peaks(j));
    double every;
    if (!(j->spec.t_end > 0))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "t_end is missing: give it in the model or as an option");
    if (j->run->reference)
        KMP_TRY(kmp_reference_read(j->system, j->run->reference, &j->reference));
    j->has_reference = j->run->reference;
    KMP_TRY(kmp_times_spacing(j->system, j->run->output_step, j->spec.t_end, &every));
    kmp_samples_limit(&j->reference, j->spec.t_end);
    KMP_TRY(
        kmp_made(j->context, kmp_times_init(&j->times, every, j->spec.t_end, j->has_reference ? &j->reference : NULL)));
    j->spec.time_count = j->times.count;
    j->spec.times = j->times.t;
    /* Continues after the last row of a checkpoint. */
    if (!j->run->resume)
        return KEMPE_OK;
    KMP_TRY(kmp_checkpoint_read(j->system, j->run->resume, &j->before, &j->past));
    j->spec.past_start = j->past;
    int last = j->before.rows - 1, n = j->system->n;
    double *state = KMP_ARENA_NEW(&j->arena, double, 2 * n);
    KMP_TRY(kmp_made(j->context, state));
    memcpy(state, kmp_samples_get(&j->before, KMP_QUANTITY_Q, last), (size_t)n * sizeof *state);
    memcpy(state + n, kmp_samples_get(&j->before, KMP_QUANTITY_QD, last), (size_t)n * sizeof *state);
    j->resumed = (kempe_assembly){.system = j->system, .q = state, .qd = state + n, .closed = true};
    j->start = &j->resumed;
    j->spec.t_start = kmp_samples_time(&j->before, last);
    j->spec.work_start = kmp_samples_work(&j->before, last);
    j->spec.continues = true;
    if (!(j->spec.t_start < j->spec.t_end))
        return kmp_fail(j->context, KEMPE_E_ARGUMENT, "the checkpoint is already at t = %g s, t_end is %g s",
                        j->spec.t_start, j->spec.t_end);
    while (j->spec.time_count > 0 && *j->spec.times <= j->spec.t_start) {
        j->spec.times++;
        j->spec.time_count--;
    }
    return KEMPE_OK;
}

/* -- the trajectory ---------------------------------------------------------------------------------- */

static double *unknowns(kmp_arena *arena, int count)
{
    double *x = KMP_ARENA_NEW(arena, double, count);
    for (int k = 0; x && k < count; k++)
        x[k] = NAN;
    return x;
}

static kempe_trajectory *trajectory_new(const kmp_simulation *j)
{
    const kmp_run_spec *spec = &j->spec;
    kempe_trajectory *t = KMP_NEW(kempe_trajectory, 1);
    if (!t)
        return NULL;
    kmp_arena arena = {0};
    *t = (kempe_trajectory){.system = j->system,
                            .integrator = spec->integrator,
                            .source = j->run->reference ? kmp_arena_strdup(&arena, j->run->reference) : NULL,
                            .verdict = kmp_verdict_none(),
                            .least_norm = j->least_norm,
                            .log = {.context = j->context},
                            .reaction = unknowns(&arena, 3 * j->system->model->closure_count),
                            .at = unknowns(&arena, 3 * j->system->n + j->system->m),
                            .shown = unknowns(&arena, kmp_outputs_width(j->system->model))};
    /* Without what belongs to the caller. */
    t->spec = *spec;
    t->spec.u = spec->u_count > 0 ? kmp_arena_copy(&arena, spec->u, spec->u_count, sizeof *spec->u) : NULL;
    t->spec.past_start = NULL;
    t->spec.times = NULL;
    t->spec.time_count = 0;
    t->spec.log = NULL;
    t->arena = arena;
    kmp_samples_init(&t->table, j->system->n, j->system->m);
    if (!arena.failed)
        return t;
    kempe_trajectory_free(t);
    return NULL;
}

KMP_FREES(kempe_trajectory, trajectory, kmp_free(trajectory->reason), kmp_free(trajectory->report.reason),
          kmp_free(trajectory->warnings), kmp_text_free(&trajectory->remarks),
          kmp_recording_free(trajectory->recording), kmp_reaction_watch_free(trajectory->watch),
          kmp_run_log_free(&trajectory->log), kmp_samples_free(&trajectory->table), kmp_arena_free(&trajectory->arena))

/* -- run --------------------------------------------------------------------------------------------- */

const double *kmp_samples_shown(const kmp_samples *table, kmp_evaluator *eval, int row)
{
    eval->inputs.before = true;
    if (table->shown)
        return table->shown + (ptrdiff_t)row * kmp_outputs_width(eval->system->model);
    return kmp_eval_shown(eval, kmp_samples_instant(table, row), kmp_samples_get(table, KMP_QUANTITY_Q, row),
                          kmp_samples_get(table, KMP_QUANTITY_QD, row), kmp_samples_get(table, KMP_QUANTITY_QDD, row),
                          kmp_samples_get(table, KMP_QUANTITY_LAMBDA, row));
}

double kmp_trajectory_trusted_gap(const kempe_trajectory *t)
{
    return fmin(TRUSTED_GAP * (t->spec.rtol + t->spec.atol), KMP_VISIBLE);
}

bool kmp_trajectory_loses_energy(const kempe_trajectory *t)
{
    const double exchanged = t->report.most - t->report.least;
    const double limit = t->table.rows < FEW_ROWS && !(exchanged > 0) ? OF_FEW_ROWS : KMP_VISIBLE;
    return t->verdict.left > limit && t->verdict.drift > limit * exchanged &&
           !(t->verdict.moved <= KMP_AT_REST * t->spec.atol);
}

/* A complete run may be wrong: its closure residuals and its energy balance show that. */
static void warn_of_verdict(const kempe_trajectory *t)
{
    if (t->verdict.h_max > kmp_trajectory_trusted_gap(t))
        kmp_doubt(t->system->context, "the loops open by %.2g of the characteristic length: %s", t->verdict.h_max,
                  kmp_accuracy_remedy(t->spec.rtol));
    if (t->verdict.misfit * t->system->length > t->system->closure_tolerance)
        kmp_doubt(t->system->context,
                  "constraint equation '%s', omitted as redundant, is open by %.2g m at t = %.9g s (closure_tolerance "
                  "%.2g m): it is not redundant there; check the lengths",
                  t->system->row_names[t->verdict.misfit_row], t->verdict.misfit * t->system->length,
                  t->verdict.misfit_t, t->system->closure_tolerance);
    if (!kmp_trajectory_loses_energy(t))
        return;
    if (t->report.prescribed)
        kmp_log(t->system->context, KEMPE_LOG_WARNING,
                "the work of the drives has the relative error %.2g: use a max_step; the motion, which the drives "
                "prescribe, does not depend on it",
                t->verdict.drift_rel);
    else
        kmp_doubt(t->system->context, "the energy error is %.2g of the energy exchanged: %s", t->verdict.drift_rel,
                  kmp_accuracy_remedy(t->spec.rtol));
}

/* Multipliers that redundant rows leave open have no error. */
static kempe_status leave_out_shared(const kempe_trajectory *t, kmp_simulation *j, kmp_evaluator *eval)
{
    int count;
    bool *shared = KMP_ARENA_NEW(&j->arena, bool, t->system->m);
    j->reference.shared = shared;
    KMP_TRY(kmp_made(j->context, shared));
    if (t->table.rows == 0)
        return KEMPE_OK;
    return kmp_find_shared(eval, kmp_samples_time(&t->table, 0), kmp_samples_get(&t->table, KMP_QUANTITY_Q, 0), shared,
                           &count);
}

static bool shows_loads(const kempe_model *model)
{
    bool any = false;
    for (int k = 0; k < model->output_count; k++) {
        const kmp_output_kind kind = model->outputs[k].kind;
        any = any || kind == KMP_OUTPUT_SENSOR || kind == KMP_OUTPUT_REACTION || kind == KMP_OUTPUT_MOMENT ||
              kind == KMP_OUTPUT_JOINT_REACTION || kind == KMP_OUTPUT_JOINT_MOMENT || kind == KMP_OUTPUT_BEARING;
    }
    return any && model->closure_count > kmp_model_friction_count(model);
}

/* Outputs of all rows with the loads of least norm. */
static kempe_status share_loads(kempe_trajectory *t, const kmp_simulation *j, kmp_evaluator *eval)
{
    const kempe_model *model = t->system->model;
    const int width = kmp_outputs_width(model);
    kmp_all_loads loads;
    KMP_TRY(kmp_all_loads_init(&loads, t->system));
    const int count = KMP_LOAD_VALUES * (model->closure_count + loads.joints);
    double *all = KMP_ARENA_NEW(&loads.arena, double, count + 1), *shown = KMP_NEW(double, t->table.rows *width);
    kempe_status status = kmp_made(j->context, all && shown);
    for (int row = 0; status == KEMPE_OK && row < t->table.rows; row++) {
        double *here = shown + (ptrdiff_t)row * width;
        memcpy(here, kmp_samples_shown(&t->table, eval, row), (size_t)width * sizeof *here);
        const kmp_instant at = kmp_instant_of(
            eval, kmp_samples_time(&t->table, row), kmp_samples_get(&t->table, KMP_QUANTITY_Q, row),
            kmp_samples_get(&t->table, KMP_QUANTITY_QD, row), kmp_samples_get(&t->table, KMP_QUANTITY_QDD, row),
            kmp_samples_get(&t->table, KMP_QUANTITY_LAMBDA, row));
        const double *before = kmp_all_loads_at(&loads, &at);
        memcpy(all, before, (size_t)count * sizeof *all);
        status = kmp_least_norm_loads(eval, at.t, at.q, loads.joints, loads.joint, all);
        const double *bearings = loads.bearing_count > 0 ? kmp_all_loads_bearings(&loads, &at, all) : NULL;
        if (status == KEMPE_OK && !kmp_loads_in_outputs(&loads, model, before, all, bearings, here))
            status = kmp_fail(j->context, KEMPE_E_FAILED,
                              "loads of least norm are not known for the forces of this model; omit --loads");
    }
    kmp_all_loads_free(&loads);
    if (status == KEMPE_OK)
        t->table.shown = shown;
    else
        kmp_free(shown);
    return status;
}

/* The reactions and outputs of the last row, and after KEMPE_OK whether such loads are unique. */
static kempe_status judge_last_row(kempe_trajectory *t, kmp_evaluator *eval, kempe_status status)
{
    const kempe_model *model = t->system->model;
    const int last = t->table.rows - 1, shown = kmp_outputs_width(model);
    const double at[2] = {kmp_samples_time(&t->table, 0), kmp_samples_time(&t->table, last)};
    const double *const q[2] = {kmp_samples_get(&t->table, KMP_QUANTITY_Q, 0),
                                kmp_samples_get(&t->table, KMP_QUANTITY_Q, last)};
    const double *lambda = kmp_samples_get(&t->table, KMP_QUANTITY_LAMBDA, last);
    if (model->closure_count > 0)
        memcpy(t->reaction, kmp_eval_reactions(eval, at[1], q[1], lambda),
               3 * (size_t)model->closure_count * sizeof(double));
    if (shown > 0)
        memcpy(t->shown, kmp_samples_shown(&t->table, eval, last), (size_t)shown * sizeof(double));
    if (status == KEMPE_OK && (shows_loads(model) || kmp_model_has_loads(model)))
        status = kmp_warn_of_shared_loads(eval, at, q, t->shown, t->table.shown);
    return status;
}

/* Counts the changes of the assembly mode from row to row of a complete motion, if the start holds coordinates. */
static void count_mode_changes(kempe_trajectory *t)
{
    const bool *held = t->system->model->start.hold;
    bool watched = false;
    for (int k = 0; k < t->system->n && t->status == KEMPE_OK && t->table.rows > 1; k++)
        watched = watched || held[k];
    kmp_mode_watch *watch = watched ? kmp_mode_watch_new(t->system, held, kmp_samples_time(&t->table, 0),
                                                         kmp_samples_get(&t->table, KMP_QUANTITY_Q, 0), NULL)
                                    : NULL;
    t->watches_modes = watch;
    for (int row = 0; watch && row < t->table.rows; row++) {
        const double at = kmp_samples_time(&t->table, row);
        const kmp_loop_block *block = kmp_mode_watch_next(watch, at, kmp_samples_get(&t->table, KMP_QUANTITY_Q, row));
        if (block && t->mode_changes++ == 0) {
            t->mode_t[0] = kmp_samples_time(&t->table, row - 1);
            t->mode_t[1] = at;
            t->mode_coordinate = block->columns[0];
        }
    }
    kmp_mode_watch_free(watch);
}

static kempe_status judge(kempe_trajectory *t, kmp_simulation *j)
{
    const kempe_model *model = t->system->model;
    kmp_evaluator *eval =
        kmp_eval_new_for(t->system, t->table.rows < MANY_ROWS ? "tape" : t->spec.backend, NULL, KMP_EVAL_WEIGHS);
    if (!eval)
        return KEMPE_E_MEMORY;
    kempe_status status = j->has_reference ? leave_out_shared(t, j, eval) : KEMPE_OK;
    if (status == KEMPE_OK)
        t->verdict = kmp_verdict_of(&t->table, eval, j->has_reference ? &j->reference : NULL);
    warn_of_verdict(t);
    count_mode_changes(t);
    if (status == KEMPE_OK && j->least_norm && shows_loads(model) && t->table.rows > 0)
        status = share_loads(t, j, eval);
    for (int row = 0; t->system->use_count > 0 && row < t->table.rows; row++)
        kmp_eval_report_tables(eval, kmp_samples_time(&t->table, row), kmp_samples_shown(&t->table, eval, row));
    kmp_remark_conditions(t->system, &t->log, &t->remarks);
    kmp_warn_of_lift_off(t->system, &t->table);
    const kempe_status doubted = kmp_doubt_flexible(&t->table, eval);
    status = status == KEMPE_OK ? doubted : status;
    if (t->table.rows > 0)
        status = judge_last_row(t, eval, status);
    kmp_eval_free(eval);
    return status;
}

/* The checkpoint of a run at its present state, without doubts of the model itself, which are not of this run. */
static kempe_status keep_checkpoint(const kmp_simulation *j, const kempe_trajectory *t)
{
    return checkpoint_write(t->system, &t->table, j->kept.past, kmp_context_doubts(j->context) + j->doubts,
                            j->run->checkpoint);
}

/* The target of rows: the table, and every few seconds the table goes into the checkpoint. */
typedef struct sink {
    kempe_trajectory *t;
    const kmp_simulation *j;
    const char *checkpoint;
    kmp_program_cache_past *kept;
    int covered; /* the last row that the past reaches */
    time_t written;
} sink;

static int take_row(void *user, double t, const double *q, const double *qd, const double *qdd, const double *lambda,
                    double work)
{
    sink *s = user;
    if (kmp_samples_add(&s->t->table, t, q, qd, qdd, lambda, work))
        return 1;
    bool due = s->checkpoint && time(NULL) - s->written >= CHECKPOINT_SECONDS;
    kempe_status written = due ? keep_checkpoint(s->j, s->t) : KEMPE_OK;
    s->written = due ? time(NULL) : s->written;
    const kmp_past *past = s->kept->past;
    while (past && s->covered + 1 < s->t->table.rows && kmp_samples_time(&s->t->table, s->covered + 1) <= past->known)
        s->covered++;
    s->kept->since = past ? kmp_samples_time(&s->t->table, s->covered) : t;
    return written != KEMPE_OK;
}

static int take_step(void *user, kmp_runner *runner, double from, double to)
{
    kmp_simulation *j = user;
    if (j->counts.steps)
        kmp_step_counts_add(&j->counts, from, to);
    return j->trajectory->watch && !kmp_reaction_watch_step(j->trajectory->watch, runner, from, to);
}

static kempe_status integrate(kmp_simulation *j, kempe_trajectory *t)
{
    /* Numbers of steps, for a check of parts. */
    const int rows = j->spec.time_count;
    if (j->system->model->wheel_count > 0 && !j->run->no_convergence_check && !j->run->full_convergence_check &&
        rows > 0) {
        j->counts =
            (kmp_step_counts){.rows = rows, .time = j->spec.times, .steps = KMP_ARENA_NEW(&j->arena, long, rows)};
        KMP_TRY(kmp_made(j->context, j->counts.steps));
    }
    if (j->watches)
        KMP_TRY(kmp_reaction_watch_new(j->system, j->spec.rtol, j->least_norm, &t->watch));
    j->spec.step = j->counts.steps || t->watch ? take_step : NULL;
    j->spec.user = j;
    sink s = {t, j, j->run->checkpoint, &j->kept, j->before.rows > 0 ? j->before.rows - 1 : 0, time(NULL)};
    if (j->before.rows > 0) {
        kmp_samples_free(&t->table);
        t->table = j->before;
        kmp_samples_init(&j->before, j->system->n, j->system->m);
    }
    j->spec.log = &t->log;
    const double most = j->run->keep_dense ? 0 : DENSE_OF_WHEELS;
    if ((j->run->keep_dense || j->judge_needs) && !(j->spec.recording = t->recording = kmp_recording_new(most)))
        return kmp_fail_memory(j->context);
    j->kept.since = j->spec.t_start;
    j->spec.kept_past = s.checkpoint ? &j->kept : NULL;
    kempe_status status = kmp_run(j->system, &j->spec, j->start, take_row, &s, &t->report);
    j->spec.recording = NULL;
    j->spec.kept_past = NULL;
    j->spec.step = NULL;
    j->spec.user = NULL;
    if (t->recording)
        kmp_recording_keep_spec(t->recording, &t->spec);
    if (t->report.integrator)
        t->integrator = t->report.integrator;
    if (s.checkpoint && t->table.rows > 0) {
        kempe_status written = keep_checkpoint(j, t);
        status = written == KEMPE_OK ? status : written == KEMPE_E_IO ? KEMPE_E_FAILED : written;
    }
    return status;
}

/* A row at an event belongs to the step that ends there: its forces are those before the event. */
static kempe_status find_sides(kempe_trajectory *t)
{
    kmp_samples *table = &t->table;
    for (int k = 0, row = 0; k < t->log.kept; k++) {
        const kmp_log_entry *entry = &t->log.entries[k];
        if (strcmp(entry->kind, "event") != 0)
            continue;
        while (row + 1 < table->rows && kmp_samples_time(table, row + 1) <= entry->t)
            row++;
        const double late = row > 0 ? entry->t - kmp_samples_time(table, row) : INFINITY;
        if (!(late >= 0 && late <= KMP_BEFORE_EVENT * fabs(entry->t)))
            continue;
        if (!table->from) {
            table->from = KMP_NEW(double, table->rows);
            KMP_TRY(kmp_made(t->system->context, table->from));
            memcpy(table->from, table->t, (size_t)table->rows * sizeof *table->t);
        }
        table->from[row] = entry->t - KMP_BEFORE_EVENT * fabs(entry->t);
    }
    return KEMPE_OK;
}

const char *kmp_trajectory_unit(const kempe_trajectory *t)
{
    int k = t->again.index;
    if (t->system->n == 0)
        return NULL;
    return k >= kmp_model_coordinates(t->system->model) ? "" : t->system->model->motions[k].rotation ? "rad" : "m";
}

/* The convergence check: an error of a complete run shows at another tolerance. */
static kempe_status run_again(kempe_trajectory *t, kmp_simulation *j)
{
    j->spec.rate_scale = t->report.rate_scale;
    j->counts.changes = t->report.events > 0 || t->report.impacts > 0 || t->report.changes > 0;
    if (j->counts.steps && !j->counts.changes && kmp_run_judge_find())
        KMP_TRY(kmp_run_judge_find()->loses_contact(j->system, &t->table, &j->counts.changes));
    kempe_status status = kmp_convergence_of_run(j->system, &j->spec, j->start, &t->table, t->report.requested,
                                                 j->counts.steps ? &j->counts : NULL, &t->again);
    const bool bounded = !isnan(t->again.stopped) && j->spec.max_steps > 0;
    const bool advised =
        t->verdict.h_max > kmp_trajectory_trusted_gap(t) || (!t->report.prescribed && kmp_trajectory_loses_energy(t));
    if (status == KEMPE_OK && j->system->n > 0)
        kmp_convergence_warn(j->context, &t->again, j->system->model->motions[t->again.index].name,
                             kmp_trajectory_unit(t),
                             bounded   ? "allow more steps (max_steps)"
                             : advised ? ""
                                       : kmp_accuracy_remedy(t->spec.rtol));
    if (status == KEMPE_OK && t->again.form > 0)
        kmp_log(j->context, KEMPE_LOG_WARNING,
                "the angles from '%s' on pass their singular position: at rtol %.3g they differ from t = %.6g s on; "
                "the rotation is right, its angles are not unique",
                j->system->model->motions[t->again.form - 1].name, t->again.rtol, t->again.form_t);
    return status;
}

const kmp_run_judge *kmp_run_judge_find(void)
{
    for (const kmp_wing *const *wing = kmp_wings; *wing; wing++)
        if ((*wing)->judge)
            return (*wing)->judge;
    return NULL;
}

/* By the judge of a wing, from the dense output, which is then kept only for the caller. */
static kempe_status judge_further(kempe_trajectory *t, const kmp_simulation *j)
{
    if (!t->recording || !j->judge_needs)
        return KEMPE_OK;
    kempe_status status = kmp_run_judge_find()->judge(t->system, t->recording, j->judge_needs, &t->arena, &t->judged);
    if (!j->run->keep_dense) {
        kmp_recording_free(t->recording);
        t->recording = NULL;
    }
    return status;
}

kempe_status kmp_simulation_begin(kmp_simulation *j, const kempe_system *system, const kempe_run_options *options)
{
    *j = (kmp_simulation){.system = system, .context = system->context, .run = options};
    j->doubts = strlen(kmp_context_doubts(j->context));
    kmp_samples_init(&j->before, system->n, system->m);
    const kmp_run_judge *judge = kmp_run_judge_find();
    if (judge)
        KMP_TRY(judge->prepare(system, options, &j->arena, &j->judge_needs));
    kmp_context_clear(j->context); /* the messages of that search */
    return read_options(j);
}

/* Finds an equilibrium at which the run begins; a run that continues began there, too. */
static kempe_status begin(kmp_simulation *j, kempe_trajectory *t)
{
    if (!j->system->model->start.at)
        return KEMPE_OK;
    KMP_TRY(kmp_assembly_at_start(j->system, &j->assembled));
    j->start = j->start ? j->start : j->assembled;
    return kmp_made(j->context, kmp_start_balance_copy(&t->arena, j->assembled->balance, &t->balance));
}

kempe_status kmp_simulation_run(kmp_simulation *j)
{
    kempe_trajectory *t = trajectory_new(j);
    KMP_TRY(kmp_made(j->context, t));
    j->trajectory = t;
    kempe_status status = begin(j, t);
    status = status == KEMPE_OK ? integrate(j, t) : status;
    if (status == KEMPE_STOPPED && t->report.requested)
        status = KEMPE_OK;
    if (!kmp_has_result(status))
        return status;
    t->status = status;
    t->interrupted = kmp_interrupted(j->context);
    KMP_TRY(find_sides(t));
    /* Moves the reason out of the report. A run without one takes the context's message as its reason; the reason of a
     * failure becomes the message. */
    const char *message = kempe_context_message(j->context);
    t->reason = t->report.reason ? t->report.reason : kmp_strdup(t->status == KEMPE_OK ? "" : message);
    t->report.reason = NULL;
    KMP_TRY(kmp_made(j->context, t->reason));
    if (t->status == KEMPE_E_FAILED && !strstr(message, t->reason)) {
        if (strstr(t->reason, message)) /* an earlier message is part of it: not twice */
            kmp_context_clear(j->context);
        return kmp_fail(j->context, KEMPE_E_FAILED, "%s", t->reason);
    }
    return t->status;
}

kempe_status kmp_simulation_judge(kmp_simulation *j, kempe_status status)
{
    kempe_trajectory *t = j->trajectory;
    if (!kmp_has_result(status))
        return status;
    const size_t kept = strlen(kmp_context_doubts(j->context)); /* in the checkpoint, if there is one */
    kempe_status judged = judge(t, j);
    if (judged == KEMPE_OK)
        judged = judge_further(t, j);
    status = judged == KEMPE_OK ? status : judged;
    if (status == KEMPE_OK && !j->run->no_convergence_check)
        status = run_again(t, j);
    const bool doubted = strlen(kmp_context_doubts(j->context)) > kept;
    return status == KEMPE_OK && doubted && j->run->checkpoint && t->table.rows > 0 ? keep_checkpoint(j, t) : status;
}

kempe_status kmp_simulation_end(kmp_simulation *j, kempe_status status, kempe_trajectory **trajectory)
{
    if (j->trajectory)
        j->trajectory->warnings = kmp_context_warnings(j->context);
    if (j->trajectory && kmp_has_result(status))
        *trajectory = j->trajectory;
    else
        kempe_trajectory_free(j->trajectory);
    kmp_arena_free(&j->arena);
    kmp_samples_free(&j->reference);
    kmp_times_free(&j->times);
    kmp_samples_free(&j->before);
    kmp_past_free(j->past);
    kmp_past_free(j->kept.past);
    kempe_assembly_free(j->assembled);
    return status;
}

/* -- states between the rows ------------------------------------------------------------------------ */

/* A time that is equal to the end up to rounding, such as the time of a last row, is the end. */
static kempe_status check_time(const kempe_trajectory *trajectory, double *at)
{
    const double t = *at;
    kempe_context *context = trajectory->system->context;
    double from, until;
    if (!trajectory->recording)
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "the run has rows only: set keep_dense for states at any other time");
    if (!kmp_recording_ends(trajectory->recording, &from, &until))
        return kmp_fail(context, KEMPE_E_ARGUMENT, "t = %.9g s: the run has no state", t);
    if (t >= from && t <= kmp_last_equal(until)) {
        *at = t < until ? t : until;
        return KEMPE_OK;
    }
    return kmp_fail(context, KEMPE_E_ARGUMENT, "t = %.9g s is not within the run, from %.9g to %.9g s", t, from, until);
}

static double *take(double *to, double *from, int count)
{
    if (to)
        memcpy(to, from, (size_t)count * sizeof *to);
    return from + count;
}

kempe_status kempe_trajectory_at_time(kempe_trajectory *trajectory, double t, double *q, double *qd, double *qdd,
                                      double *lambda)
{
    KMP_WANTED(NULL, trajectory, "trajectory");
    int n = trajectory->system->n;
    double *row = trajectory->at;
    kmp_model_begin(trajectory->system->model);
    KMP_TRY(check_time(trajectory, &t));
    KMP_TRY(kmp_recording_row(trajectory->recording, t, true, row));
    (void)take(lambda, take(qdd, take(qd, take(q, row, n), n), n), trajectory->system->m);
    return KEMPE_OK;
}

/* -- getters ----------------------------------------------------------------------------------------- */

KMP_GETTER(int kempe_trajectory_row_count(const kempe_trajectory *trajectory), trajectory, trajectory->table.rows, 0)

KMP_GETTER_AT(double kempe_trajectory_time(const kempe_trajectory *trajectory, int row), trajectory, row,
              trajectory->table.rows, kmp_samples_time(&trajectory->table, row), NAN)

#define ROW(name, quantity)                                                                                            \
    KMP_GETTER_AT(const double *kempe_trajectory_##name(const kempe_trajectory *trajectory, int row), trajectory, row, \
                  trajectory->table.rows, kmp_samples_get(&trajectory->table, quantity, row), NULL)

ROW(q, KMP_QUANTITY_Q)
ROW(qd, KMP_QUANTITY_QD)
ROW(qdd, KMP_QUANTITY_QDD)
ROW(lambda, KMP_QUANTITY_LAMBDA)

KMP_GETTER(kempe_outcome kempe_trajectory_outcome(const kempe_trajectory *trajectory), trajectory,
           kmp_outcome_checked(trajectory->status, trajectory->again.known), KEMPE_OUTCOME_NONE)
KMP_GETTER(const char *kempe_trajectory_reason(const kempe_trajectory *trajectory), trajectory, trajectory->reason, "")
