/* SPDX-License-Identifier: BSD-3-Clause */
/* Reading reference values: the header is resolved to entries once, then each line is fields. */
#include "output/reference.h"
#include "base/memory.h"
#include "model/data/model.h"
#include "model/data/output_table.h"
#include "model/files/csv_reader.h"
#include "model/language/nearest.h"
#include <math.h>
#include <string.h>

typedef enum column_kind { COLUMN_UNKNOWN, COLUMN_PASSED, COLUMN_TIME, COLUMN_VALUE } column_kind;

typedef struct column {
    column_kind kind;
    kmp_quantity quantity;
    int index;
} column;

typedef struct reader {
    const kempe_system *system;
    column *columns;
    int column_count; /* known so far */
    kmp_reference *reference;
} reader;

/* -- header ------------------------------------------------------------------------------------------ */

/* Finds the entry of the column `name`, and offers every known name for the suggestion, kept in `known`. False: no
 * memory. */
static bool find_column(reader *r, const char *name, kmp_nearest *nearest, char *known, size_t size, column *found)
{
    for (int k = 0; k <= KMP_QUANTITY_STATE; k++)
        for (int i = 0; i < kmp_quantity_size(r->system, (kmp_quantity)k); i++) {
            kmp_text text = {0};
            kmp_text_printf(&text, "%s.%s", kmp_quantity_prefix((kmp_quantity)k),
                            kmp_quantity_name(r->system, (kmp_quantity)k, i));
            if (text.failed)
                return false;
            const bool state = k == KMP_QUANTITY_STATE; /* it is the rate of its motion */
            if (strcmp(text.s, name) == 0)
                *found = (column){COLUMN_VALUE, state ? KMP_QUANTITY_QD : (kmp_quantity)k,
                                  state ? kmp_model_coordinates(r->system->model) + i : i};
            const char *best = nearest->best;
            int before = nearest->distance;
            kmp_nearest_offer(nearest, text.s);
            nearest->best = nearest->distance < before && text.length < size ? strcpy(known, text.s) : best;
            kmp_text_free(&text);
        }
    return true;
}

static bool complain_column(kmp_csv *csv, const reader *r, const char *at, const char *name, const kmp_nearest *nearest)
{
    kmp_text sentence = {0};
    const bool coordinate = kmp_name_find(KMP_COORDINATES(r->system->model), name) >= 0;
    kmp_text_printf(&sentence, "unknown column '%s'", name);
    if (coordinate)
        kmp_text_printf(&sentence, "; the column of the coordinate is 'q.%s'", name);
    else
        kmp_nearest_suggest(nearest, &sentence);
    if (!coordinate && !nearest->best)
        kmp_text_put(&sentence, ": columns are t, q.NAME, qd.NAME, qdd.NAME and lambda.CLOSURE.k");
    bool ok = !sentence.failed;
    if (ok)
        kmp_csv_complain(csv, at, "%s", sentence.s);
    kmp_text_free(&sentence);
    return ok;
}

static bool stands_before(const reader *r, const column *c)
{
    int k = c->kind < COLUMN_TIME ? r->column_count : 0;
    while (k < r->column_count &&
           !(c->kind == r->columns[k].kind && c->quantity == r->columns[k].quantity && c->index == r->columns[k].index))
        k++;
    return k < r->column_count;
}

/* The cut joint that has a coordinate with a name of `length`; NULL: none. */
static const char *cut_joint(const kempe_model *model, const char *name, size_t length)
{
    for (int k = 0; k < model->cut_coordinate_count; k++) {
        const char *own = model->cut_coordinates[k].name;
        if (strlen(own) == length && memcmp(own, name, length) == 0)
            return model->cut_coordinates[k].joint;
    }
    return NULL;
}

/* True for columns of computed outputs, "velocity.crank.B.x", and of inverse dynamics' generalized forces. */
static bool is_computed(const kempe_model *model, kmp_csv_field f)
{
    static const char *const others[] = {"tau", "power"};
    const size_t rows = sizeof kmp_output_rows / sizeof *kmp_output_rows, more = sizeof others / sizeof *others;
    for (size_t k = 0; k < rows + more; k++) {
        const char *word = k < rows ? kmp_output_rows[k].word : others[k - rows];
        size_t length = strlen(word);
        bool here = k >= rows || kmp_output_rows[k].width > 0;
        bool cut = k < rows && kmp_output_rows[k].argument == KMP_OUTPUT_OF_CUT;
        if (here && f.length > length + 1 && f.s[length] == '.' && memcmp(f.s, word, length) == 0 &&
            (!cut || cut_joint(model, f.s + length + 1, f.length - length - 1)))
            return true;
    }
    return false;
}

static bool resolve(kmp_csv *csv, reader *r, kmp_csv_field f, column *c)
{
    char known[128];
    kmp_text name = {0};
    if (kmp_csv_is(f, "t"))
        c->kind = COLUMN_TIME;
    else if (is_computed(r->system->model, f))
        c->kind = COLUMN_PASSED;
    if (c->kind == COLUMN_PASSED && f.length > 2 && !r->reference->cut && memcmp(f.s, "q.", 2) == 0)
        r->reference->cut = cut_joint(r->system->model, f.s + 2, f.length - 2);
    if (c->kind != COLUMN_UNKNOWN)
        return true;
    kmp_text_printf(&name, "%.*s", (int)f.length, f.s);
    kmp_nearest nearest = kmp_nearest_begin(name.s ? name.s : "");
    bool ok = name.s && !name.failed && find_column(r, name.s, &nearest, known, sizeof known, c);
    if (ok && c->kind == COLUMN_UNKNOWN)
        ok = complain_column(csv, r, f.s, name.s, &nearest);
    kmp_text_free(&name);
    return ok;
}

static bool read_header(kmp_csv *csv, const char *line)
{
    reader *r = csv->user;
    bool time = false;
    r->columns = KMP_NEW(column, csv->columns);
    if (!r->columns)
        return false;
    for (const char *s = line; s && kmp_csv_goes_on(csv); r->column_count++) {
        kmp_csv_field f = kmp_csv_name(&s);
        column *c = &r->columns[r->column_count];
        if (!resolve(csv, r, f, c))
            return false;
        if (stands_before(r, c))
            kmp_csv_complain(csv, f.s, "duplicate column");
        if (c->kind >= COLUMN_TIME)
            kmp_csv_check_unit(csv, r->column_count, f.s,
                               c->kind == COLUMN_TIME ? "s" : kmp_quantity_unit(r->system, c->quantity, c->index));
        time = time || c->kind == COLUMN_TIME;
    }
    if (!time)
        kmp_csv_complain(csv, line, "column t is missing");
    return true;
}

/* -- rows -------------------------------------------------------------------------------------------- */

static void take_time(kmp_csv *csv, kmp_reference *reference, int at, kmp_csv_field f)
{
    double *t = &reference->t[reference->rows - 1];
    if (!kmp_csv_number(csv, at, f, t))
        kmp_csv_complain(csv, f.s, "a time is expected here");
    else if (*t < 0)
        kmp_csv_complain(csv, f.s, "times begin at 0");
    else if (reference->rows > 1 && *t <= t[-1])
        kmp_csv_complain(csv, f.s, "times must increase from row to row");
}

static void take_value(kmp_csv *csv, const reader *r, int k, kmp_csv_field f)
{
    const column *c = &r->columns[k];
    size_t width = (size_t)(c->quantity == KMP_QUANTITY_LAMBDA ? r->system->m : r->system->n);
    double *value = &r->reference->value[c->quantity][(size_t)(r->reference->rows - 1) * width + (size_t)c->index];
    if (f.length > 0 && !kmp_csv_number(csv, k, f, value))
        kmp_csv_complain(csv, f.s, "this is not a number; write a number, or leave the field empty");
}

static bool read_row(kmp_csv *csv, const char *line)
{
    reader *r = csv->user;
    if (!kmp_samples_extend(r->reference))
        return false;
    const char *s = line;
    for (int k = 0; s && k < r->column_count; k++) {
        kmp_csv_field f = kmp_csv_next(&s);
        if (r->columns[k].kind == COLUMN_TIME)
            take_time(csv, r->reference, k, f);
        else if (r->columns[k].kind == COLUMN_VALUE)
            take_value(csv, r, k, f);
    }
    kmp_csv_check_row(csv, line);
    return true;
}

static const kmp_csv_form form = {"the header line is missing; it begins with t", NULL, read_header, read_row, false};

kempe_status kmp_reference_read(const kempe_system *system, const char *path, kmp_reference *reference)
{
    kmp_reference made;
    reader r = {.system = system, .reference = &made};
    kmp_samples_init(&made, system->n, system->m);
    kempe_status status = kmp_csv_read(system->context, path, &form, &r);
    kmp_free(r.columns);
    if (status != KEMPE_OK)
        kmp_samples_free(&made);
    else
        *reference = made;
    return status;
}

/* -- the times at which a run delivers rows -------------------------------------------------------------- */

enum { DEFAULT_ROWS = 200 };

kempe_status kmp_times_spacing(const kempe_system *system, double requested, double t_end, double *every)
{
    const kempe_model *model = system->model;
    const kmp_run_settings *run = &model->run;
    kmp_text complaint = {0};
    *every = requested > 0 ? requested : run->output_step > 0 ? run->output_step : t_end / DEFAULT_ROWS;
    if (kmp_rows_fit(*every, t_end, &complaint))
        return KEMPE_OK;
    if (requested > 0 || complaint.failed)
        return kmp_fail_text(system->context, KEMPE_E_ARGUMENT, &complaint);
    kempe_status status =
        kmp_complain(system->context, model->source.files[run->every_place.file], run->every_place.line,
                     run->every_place.column, "%s", complaint.s ? complaint.s : "");
    kmp_text_free(&complaint);
    return status;
}

/* k steps of `every`, as a division where 1 / every is whole: 3 / 10 is 0.3, 3 * 0.1 is not. */
static double grid_time(double every, int k)
{
    double inverse = round(1 / every);
    if (inverse >= 1 && fabs(every * inverse - 1) < 1e-15)
        return k / inverse;
    return k * every;
}

bool kmp_times_are_one(double a, double b)
{
    return fabs(a - b) <= 1e-12 * fmax(fabs(a), fabs(b));
}

/* Appends t; of two times that are one up to rounding, the firm one stays. */
static void append(kmp_times *times, double t, bool firm)
{
    if (times->count == 0 || !kmp_times_are_one(times->t[times->count - 1], t))
        times->t[times->count++] = t;
    else if (firm)
        times->t[times->count - 1] = t;
}

/* Two reference times may be as near as they like: they stay apart. */
static void append_reference(kmp_times *times, double t, const double *before)
{
    if (before && times->t[times->count - 1] <= *before && t > *before)
        times->t[times->count++] = t;
    else
        append(times, t, true);
}

bool kmp_times_init(kmp_times *times, double every, double t_end, const kmp_reference *reference)
{
    int rows = reference ? reference->rows : 0, grid = (int)(t_end / every);
    *times = (kmp_times){.t = KMP_NEW(double, grid + rows + 3)};
    if (!times->t)
        return false;
    int r = 0;
    for (int k = 0; k <= grid; k++) {
        double t = grid_time(every, k);
        for (; r < rows && reference->t[r] <= t; r++)
            append_reference(times, reference->t[r], r > 0 ? &reference->t[r - 1] : NULL);
        if (t < t_end && (r == rows || !kmp_times_are_one(t, reference->t[r])))
            append(times, t, false);
    }
    for (; r < rows; r++)
        append_reference(times, reference->t[r], r > 0 ? &reference->t[r - 1] : NULL);
    if (rows > 0 && kmp_times_are_one(reference->t[rows - 1], t_end))
        return true;
    append(times, t_end, true);
    return true;
}

KMP_CLEARS(kmp_times, times, kmp_free(times->t))
