/* SPDX-License-Identifier: BSD-3-Clause */
/* Two passes: names and times before the equations are derived, values when their units are known. */
#include "ensemble/fit/measured.h"
#include "base/memory.h"
#include "model/data/model_context.h"
#include "model/read/requests.h"
#include <math.h>
#include <string.h>

enum { TIME = -1, PASSED = -2 };

typedef struct reader {
    kmp_measured *m;
    kmp_variant *copy;             /* of the model, whose outputs are tried */
    const char *chosen;            /* NULL: all columns */
    const kempe_sensitivity *rows; /* NULL: the first pass */
    int *meaning, fields;          /* of each field: TIME, PASSED, or its column */
    kmp_text words;
    int row;
    bool time;
} reader;

/* -- names ------------------------------------------------------------------------------------------- */

static bool is_output(reader *r, const char *word)
{
    kempe_model *model = kmp_variant_model(r->copy);
    unsigned *parts = NULL;
    bool good = kmp_requested_outputs(model, word, &parts) == KEMPE_OK;
    kmp_context_clear(kmp_model_context(model));
    return good;
}

/* The word of the output whose column has a name: itself, "q(crank)" of q.crank, "position(b.P).x" of position.b.P.x.
 */
static char *word_of(reader *r, const char *name)
{
    const char *dot = strchr(name, '.'), *last = strrchr(name, '.');
    kmp_arena *arena = &r->m->arena;
    char *word = kmp_arena_strdup(arena, name);
    if (!word || is_output(r, word))
        return word;
    if (!dot)
        return NULL;
    word = kmp_arena_printf(arena, "%.*s(%s)", (int)(dot - name), name, dot + 1);
    if (!word || is_output(r, word))
        return word;
    if (last == dot)
        return NULL;
    word = kmp_arena_printf(arena, "%.*s(%.*s)%s", (int)(dot - name), name, (int)(last - dot - 1), dot + 1, last);
    if (!word || is_output(r, word))
        return word;
    word = kmp_arena_printf(arena, "%.*s(%.*s)", (int)(dot - name), name, (int)(last - dot - 1), dot + 1);
    return !word || is_output(r, word) ? word : NULL;
}

/* True if a list of names, separated by commas, has this one. */
static bool is_listed(const char *list, const char *name)
{
    size_t length = strlen(name);
    while (*list) {
        list += strspn(list, ", ");
        size_t size = strcspn(list, ", ");
        if (size == length && strncmp(list, name, length) == 0)
            return true;
        list += size;
    }
    return false;
}

static void complain_unknown(kmp_csv *csv, kmp_csv_field f)
{
    kmp_csv_complain(csv, f.s,
                     "'%.*s' is not an output of the model: columns have names as in the tables of a run, q.JOINT, "
                     "qd.JOINT, position.BODY.POINT.x, sensor.NAME; --columns chooses some",
                     (int)f.length, f.s);
}

static void add_column(kmp_csv *csv, reader *r, kmp_csv_field f)
{
    kmp_measured *m = r->m;
    char *name = kmp_arena_printf(&m->arena, "%.*s", (int)f.length, f.s);
    if (!name || (r->chosen && !is_listed(r->chosen, name)))
        return;
    const char *word = word_of(r, name);
    if (!word) {
        complain_unknown(csv, f);
        return;
    }
    kmp_text_printf(&r->words, "%s%s", r->words.length > 0 ? "," : "", word);
    r->meaning[r->fields] = m->columns;
    m->name[m->columns++] = name;
}

/* The second pass: the unit of a column that counts. */
static void check_unit(kmp_csv *csv, reader *r, kmp_csv_field f)
{
    for (int k = 0; k < r->m->columns; k++)
        if (kmp_csv_is(f, r->m->name[k]))
            r->meaning[r->fields] = k;
    bool found = r->meaning[r->fields] == PASSED;
    for (int c = 0; c < r->rows->columns; c++)
        if (kmp_csv_is(f, r->rows->column[c])) {
            kmp_csv_check_unit(csv, r->fields, f.s, r->rows->unit[c]);
            found = true;
        }
    if (!found)
        complain_unknown(csv, f);
}

static bool read_header(kmp_csv *csv, const char *line)
{
    reader *r = csv->user;
    kmp_measured *m = r->m;
    r->meaning = kmp_realloc(NULL, (size_t)csv->columns, sizeof *r->meaning);
    if (!r->rows)
        m->name = KMP_ARENA_NEW(&m->arena, char *, csv->columns);
    if (!r->meaning || !m->name)
        return false;
    for (const char *s = line; s && kmp_csv_goes_on(csv); r->fields++) {
        kmp_csv_field f = kmp_csv_name(&s);
        r->meaning[r->fields] = PASSED;
        if (kmp_csv_is(f, "t")) {
            r->meaning[r->fields] = TIME;
            r->time = true;
            kmp_csv_check_unit(csv, r->fields, f.s, "s");
        } else if (r->rows) {
            check_unit(csv, r, f);
        } else {
            add_column(csv, r, f);
        }
    }
    if (!r->time)
        kmp_csv_complain(csv, line, "column t is missing");
    return !m->arena.failed && !r->words.failed;
}

/* -- rows -------------------------------------------------------------------------------------------- */

static bool take_time(kmp_csv *csv, reader *r, int field, kmp_csv_field f)
{
    kmp_measured *m = r->m;
    double *t = kmp_list_room(m->t, (size_t)m->rows, sizeof *t), before = m->rows > 0 ? t[m->rows - 1] : -1;
    if (!t)
        return false;
    m->t = t;
    t[m->rows] = 0;
    if (!kmp_csv_number(csv, field, f, &t[m->rows]))
        kmp_csv_complain(csv, f.s, "a time is expected here");
    else if (t[m->rows] < 0)
        kmp_csv_complain(csv, f.s, "times begin at 0, the start of the model");
    else if (m->rows > 0 && t[m->rows] <= before)
        kmp_csv_complain(csv, f.s, "times must increase from row to row");
    m->rows++;
    return true;
}

static bool read_row(kmp_csv *csv, const char *line)
{
    reader *r = csv->user;
    const char *s = line;
    for (int k = 0; s && k < r->fields; k++) {
        kmp_csv_field f = kmp_csv_next(&s);
        if (!r->rows && r->meaning[k] == TIME && !take_time(csv, r, k, f))
            return false;
        if (r->rows && r->meaning[k] >= 0) {
            double *value = &r->m->value[(ptrdiff_t)r->row * r->m->columns + r->meaning[k]];
            if (f.length > 0 && !kmp_csv_number(csv, k, f, value))
                kmp_csv_complain(csv, f.s, "this is not a number; write a number, or leave the field empty");
        }
    }
    r->row++;
    kmp_csv_check_row(csv, line);
    return true;
}

/* -- the whole --------------------------------------------------------------------------------------- */

static kempe_status read_file(kempe_context *context, const char *path, reader *r)
{
    static const kmp_csv_form form = {"the header line is missing; it has t and names of outputs",
                                      "the table has no rows", read_header, read_row, false};
    kempe_status status = kmp_csv_read(context, path, &form, r);
    kmp_free(r->meaning);
    return status;
}

/* Every chosen column has been found. */
static kempe_status check_chosen(kempe_context *context, const kmp_measured *m, const char *path, const char *chosen)
{
    for (const char *s = chosen; s && *s;) {
        s += strspn(s, ", ");
        size_t length = strcspn(s, ", ");
        bool found = length == 0;
        for (int k = 0; k < m->columns; k++)
            found = found || (strlen(m->name[k]) == length && strncmp(m->name[k], s, length) == 0);
        if (!found)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "columns: '%s' has no column '%.*s'", path, (int)length, s);
        s += length;
    }
    return KEMPE_OK;
}

kempe_status kmp_measured_begin(const kempe_model *model, const char *path, const char *chosen, kmp_measured *measured)
{
    reader r = {.m = measured, .chosen = chosen};
    *measured = (kmp_measured){0};
    kempe_context *context = kmp_model_context(model);
    kempe_context *trial = kmp_context_new_below(context); /* the messages of words that are not outputs */
    kempe_status status = kmp_made(context, trial);
    if (status == KEMPE_OK)
        status = kmp_variant_new_in(trial, model, 0, NULL, &r.copy);
    if (status == KEMPE_OK)
        status = read_file(context, path, &r);
    kmp_variant_free(r.copy);
    kempe_context_free(trial);
    if (status == KEMPE_OK)
        status = check_chosen(context, measured, path, chosen);
    if (status == KEMPE_OK && measured->columns == 0)
        status = kmp_complain(context, path, 0, 0, "the table has no column of an output, only t");
    if (status == KEMPE_OK && !(measured->t[measured->rows - 1] > 0))
        status = kmp_complain(context, path, 0, 0,
                              "the last time is 0, so that no motion is compared: give rows at later times");
    measured->outputs = kmp_text_keep(&r.words, &measured->arena);
    if (status == KEMPE_OK && !measured->outputs)
        status = kmp_fail_memory(context);
    if (status != KEMPE_OK)
        kmp_measured_free(measured);
    return status;
}

kempe_status kmp_measured_read(const kempe_sensitivity *rows, const char *path, kmp_measured *measured)
{
    reader r = {.m = measured, .rows = rows};
    ptrdiff_t count = (ptrdiff_t)measured->rows * measured->columns;
    measured->value = KMP_ARENA_NEW(&measured->arena, double, count);
    KMP_TRY(kmp_made(rows->context, measured->value));
    for (ptrdiff_t k = 0; k < count; k++)
        measured->value[k] = NAN;
    return read_file(rows->context, path, &r);
}

void kmp_measured_free(kmp_measured *measured)
{
    kmp_free(measured->t);
    kmp_arena_free(&measured->arena);
    *measured = (kmp_measured){0};
}
