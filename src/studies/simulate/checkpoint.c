/* SPDX-License-Identifier: BSD-3-Clause */
#include "studies/simulate/checkpoint.h"
#include "base/file.h"
#include "base/memory.h"
#include <inttypes.h>
#include <math.h>
#include <string.h>

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
    kmp_text_printf(text, "# kempe checkpoint 2, model %s, %016" PRIx64 "\nt,work", kempe_model_name(system->model),
                    hash_of(model, strlen(model)));
    kempe_text_free(model);
    for (kmp_quantity k = KMP_QUANTITY_Q; k < KMP_QUANTITIES; k++)
        for (int i = 0; i < width_of(system, k); i++)
            kmp_text_printf(text, ",%s.%s", kmp_quantity_prefix(k), kmp_quantity_name(system, k, i));
    kmp_text_put(text, "\n");
    return KEMPE_OK;
}

static void print_row(const kempe_system *system, const kmp_samples *samples, int row, kmp_text *text)
{
    kmp_text_number(text, kmp_samples_time(samples, row));
    kmp_text_put(text, ",");
    kmp_text_number(text, kmp_samples_work(samples, row));
    for (kmp_quantity k = KMP_QUANTITY_Q; k < KMP_QUANTITIES; k++) {
        const double *value = kmp_samples_get(samples, k, row);
        for (int i = 0; i < width_of(system, k); i++) {
            kmp_text_put(text, ",");
            kmp_text_number(text, value[i]);
        }
    }
    kmp_text_put(text, "\n");
}

kempe_status kmp_checkpoint_write(const kempe_system *system, const kmp_samples *samples, const char *path)
{
    kmp_text text = {0};
    KMP_TRY(kmp_checkpoint_head(system, &text));
    for (int row = 0; row < samples->rows; row++)
        print_row(system, samples, row, &text);
    if (!text.failed)
        kmp_checkpoint_end(&text, text.s, text.length);
    return kmp_file_write(system->context, path, &text);
}

/* -- reading ----------------------------------------------------------------------------------------- */

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

static kempe_status read_rows(const kempe_system *system, const char *path, const char *text, double *row,
                              kmp_samples *samples)
{
    int n = system->n, count = 2 + 3 * n + system->m, line = 3;
    for (const char *s = text, *end; *s; s = end + 1, line++) {
        end = strchr(s, '\n');
        int column = end ? read_line(s, end, count, row) : 1;
        if (column)
            return kmp_complain(system->context, path, line, column, "a row of %d numbers is expected", count);
        if (samples->rows && row[0] <= kmp_samples_time(samples, samples->rows - 1))
            return kmp_complain(system->context, path, line, 1, "the times must increase");
        const double *q = row + 2;
        if (kmp_samples_add(samples, row[0], q, q + n, q + 2 * n, q + 3 * n, row[1]))
            return kmp_fail_memory(system->context);
    }
    if (samples->rows == 0)
        return kmp_complain(system->context, path, 3, 1,
                            "the checkpoint has no rows: there is no state to continue from");
    return KEMPE_OK;
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

static kempe_status read_text(const kempe_system *system, const char *path, const char *text, kmp_samples *samples)
{
    kmp_text head = {0};
    double *row = KMP_NEW(double, 2 + 3 * system->n + system->m);
    kempe_status status = row ? kmp_checkpoint_head(system, &head) : kmp_fail_memory(system->context);
    if (status == KEMPE_OK && (head.failed || !head.s))
        status = kmp_fail_memory(system->context);
    if (status == KEMPE_OK && strncmp(text, "# kempe checkpoint 2,", 21) != 0)
        status = kmp_complain(system->context, path, 1, 1, "this is not a checkpoint of a run");
    else if (status == KEMPE_OK && head.s && strncmp(text, head.s, head.length) != 0)
        status = kmp_complain(
            system->context, path, 1, 1,
            "the checkpoint is of another model, or the model has changed since; its first line must be: %.*s",
            (int)strcspn(head.s, "\n"), head.s);
    if (status == KEMPE_OK)
        status = read_rows(system, path, text + head.length, row, samples);
    kmp_text_free(&head);
    kmp_free(row);
    return status;
}

kempe_status kmp_checkpoint_read(const kempe_system *system, const char *path, kmp_samples *samples)
{
    char *text;
    size_t length;
    kmp_samples read;
    KMP_TRY(kmp_file_read(system->context, path, &text, &length));
    kmp_samples_init(&read, system->n, system->m);
    kempe_status status =
        strncmp(text, "# kempe checkpoint 2,", 21) == 0 ? check_end(system, path, text, length) : KEMPE_OK;
    if (status == KEMPE_OK)
        status = read_text(system, path, text, &read);
    kmp_free(text);
    if (status == KEMPE_OK) {
        kmp_samples_free(samples);
        *samples = read;
    } else {
        kmp_samples_free(&read);
    }
    return status;
}
