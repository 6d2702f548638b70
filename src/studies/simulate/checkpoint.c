/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/checkpoint.h"
#include "base/file.h"
#include "base/memory.h"
#include "constraints/evaluation/present_inputs.h"
#include "model/data/model.h"
#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { VERSION = 3, PIECE_HEAD = 3 };

/* 64-bit FNV-1a (Fowler, Noll, Vo): any one byte that differs changes it. */
static uint64_t hash_of(const char *s, size_t length)
{
    uint64_t hash = 0xcbf29ce484222325u;
    for (size_t i = 0; i < length; i++)
        hash = (hash ^ (unsigned char)s[i]) * 0x100000001b3u;
    return hash;
}

void kmp_checkpoint_end(kmp_text *text, const char *s, size_t length)
{
    kmp_text_printf(text, "# end, %016" PRIx64 "\n", hash_of(s, length));
}

static int width_of(const kempe_system *system, kmp_quantity quantity)
{
    return quantity == KMP_QUANTITY_LAMBDA ? system->m : system->n;
}

/* The head of a checkpoint: the model's own text, with the values of its parameters, identifies it. */
kempe_status kmp_checkpoint_head(const kempe_system *system, kmp_text *text)
{
    char *model = NULL;
    KMP_TRY(kempe_model_print(system->model, KEMPE_JSON, &model));
    kmp_text_printf(text, "# kempe checkpoint %d, model %s, %016" PRIx64 "\nt,work", VERSION,
                    kempe_model_name(system->model), hash_of(model, strlen(model)));
    kempe_text_free(model);
    for (kmp_quantity k = KMP_QUANTITY_Q; k < KMP_QUANTITIES; k++)
        for (int i = 0; i < width_of(system, k); i++)
            kmp_text_printf(text, ",%s.%s", kmp_quantity_prefix(k), kmp_quantity_name(system, k, i));
    kmp_text_put(text, "\n");
    return KEMPE_OK;
}

/* Each delayed signal: its delay and the number of its polynomials; then these: from, to, the order of the derivative
 * that jumps at its beginning, coefficients. Those that ended before the delay before t are not needed. */
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

kempe_status kmp_checkpoint_write(const kempe_system *system, const kmp_samples *samples, const kmp_past *past,
                                  const char *path)
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
    if (status == KEMPE_OK && *r->s)
        status = kmp_complain(r->system->context, r->path, r->line, 1, "the checksum is expected here");
    return KMP_GIVE_OR_FREE(status, past, read, kmp_past_free);
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
