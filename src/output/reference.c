/* SPDX-License-Identifier: BSD-3-Clause */
/* Reading reference values: the header is resolved to entries once, then each line is fields. */
#include "output/reference.h"
#include "base/file.h"
#include "base/memory.h"
#include "model/tables/nearest.h"
#include "model/tables/output_table.h"
#include <math.h>
#include <string.h>

enum { MOST_COMPLAINTS = 20 };

typedef enum column_kind { COLUMN_UNKNOWN, COLUMN_PASSED, COLUMN_TIME, COLUMN_VALUE } column_kind;

typedef struct column {
    column_kind kind;
    kmp_quantity quantity;
    int index;
} column;

typedef struct reader {
    const kempe_system *system;
    const char *path;
    int line;
    const char *line_text;
    column *columns;
    int column_count;
    int complaints;
    bool failed; /* no memory */
    int room;    /* for rows */
    kmp_reference *reference;
} reader;

/* One field of a line, without surrounding blanks. */
typedef struct field {
    const char *s;
    size_t length;
} field;

/* -- storage ----------------------------------------------------------------------------------------- */

/* The array with room for `count` values instead of `before`, the new ones NaN. NULL: no memory. */
static double *grow(double *old, size_t before, size_t count)
{
    double *grown = kmp_realloc(old, count, sizeof *grown);
    for (size_t i = before; grown && i < count; i++)
        grown[i] = NAN;
    return grown;
}

/* Makes room for `rows` rows where there is some for `before`. */
static bool reserve(kmp_reference *reference, const int *width, int before, int rows)
{
    double *t = grow(reference->t, (size_t)before, (size_t)rows);
    if (!t)
        return false;
    reference->t = t;
    for (int k = 0; k < KMP_QUANTITIES; k++) {
        size_t w = width[k] > 0 ? (size_t)width[k] : 1; /* never nothing */
        double *value = grow(reference->value[k], w * (size_t)before, w * (size_t)rows);
        if (!value)
            return false;
        reference->value[k] = value;
    }
    return true;
}

bool kmp_reference_from_table(kmp_reference *reference, const kmp_samples *table)
{
    const int width[KMP_QUANTITIES] = {table->n, table->n, table->n, table->m};
    *reference = (kmp_reference){0};
    if (!reserve(reference, width, 0, table->rows ? table->rows : 1)) {
        kmp_reference_free(reference);
        return false;
    }
    reference->rows = table->rows;
    for (int r = 0; r < table->rows; r++) {
        reference->t[r] = kmp_samples_time(table, r);
        for (int k = 0; k < KMP_QUANTITIES; k++)
            if (width[k] > 0)
                memcpy(reference->value[k] + (size_t)r * (size_t)width[k], kmp_samples_get(table, (kmp_quantity)k, r),
                       (size_t)width[k] * sizeof(double));
    }
    return true;
}

void kmp_reference_limit(kmp_reference *reference, double t_end)
{
    while (reference->rows > 0 && reference->t[reference->rows - 1] > t_end)
        reference->rows--;
}

void kmp_reference_free(kmp_reference *reference)
{
    kmp_free(reference->t);
    for (int k = 0; k < KMP_QUANTITIES; k++)
        kmp_free(reference->value[k]);
    *reference = (kmp_reference){0};
}

/* -- fields ------------------------------------------------------------------------------------------ */

/* Characters, not bytes, from the line's beginning. */
static int column_of(const reader *r, const char *at)
{
    int n = 1;
    for (const char *s = r->line_text; s < at; s++)
        n += ((unsigned char)*s & 0xc0) != 0x80;
    return n;
}

static void complain(reader *r, const char *at, const char *sentence)
{
    if (r->complaints++ < MOST_COMPLAINTS)
        (void)kmp_complain(r->system->context, r->path, r->line, column_of(r, at), "%s", sentence);
}

static bool is_blank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

/* The field that begins at *s; *s moves past the comma after it, to NULL after the last one. */
static field next_field(const char **s)
{
    size_t length = strcspn(*s, ",");
    field f = {*s, length};
    *s = (*s)[length] == ',' ? *s + length + 1 : NULL;
    while (f.length > 0 && is_blank(f.s[0])) {
        f.s++;
        f.length--;
    }
    while (f.length > 0 && is_blank(f.s[f.length - 1]))
        f.length--;
    return f;
}

static bool is(field f, const char *word)
{
    return strlen(word) == f.length && memcmp(f.s, word, f.length) == 0;
}

/* A finite number with an optional sign that fills the field. */
static bool to_number(field f, double *value)
{
    size_t sign = f.length > 0 && (f.s[0] == '-' || f.s[0] == '+');
    size_t read = kmp_text_to_number(f.s + sign, value);
    if (f.length > 0 && f.s[0] == '-')
        *value = -*value;
    return read > 0 && sign + read == f.length && isfinite(*value);
}

/* -- header ------------------------------------------------------------------------------------------ */

/* Finds the entry of the column `name`, and offers every known name for the suggestion. */
static column find_column(reader *r, const char *name, kmp_nearest *nearest, char *known, size_t size)
{
    for (int k = 0; k < KMP_QUANTITIES; k++)
        for (int i = 0; i < kmp_quantity_size(r->system, (kmp_quantity)k); i++) {
            kmp_text text = {0};
            kmp_text_printf(&text, "%s.%s", kmp_quantity_prefix((kmp_quantity)k),
                            kmp_quantity_name(r->system, (kmp_quantity)k, i));
            bool same = !text.failed && strcmp(text.s, name) == 0;
            r->failed = r->failed || text.failed;
            const char *best = nearest->best;
            int before = nearest->distance;
            if (!text.failed)
                kmp_nearest_offer(nearest, text.s);
            if (nearest->distance < before && text.length < size)
                nearest->best = strcpy(known, text.s);
            else
                nearest->best = best;
            kmp_text_free(&text);
            if (same)
                return (column){COLUMN_VALUE, (kmp_quantity)k, i};
        }
    return (column){.kind = COLUMN_UNKNOWN};
}

static void complain_column(reader *r, const char *at, const char *name, const kmp_nearest *nearest)
{
    kmp_text sentence = {0};
    kmp_text_printf(&sentence, "column '%s' is missing", name);
    kmp_nearest_suggest(nearest, &sentence);
    if (!nearest->best)
        kmp_text_put(&sentence, ": columns are t, q.NAME, qd.NAME, qdd.NAME and lambda.CLOSURE.k");
    complain(r, at, sentence.failed ? "unknown column" : sentence.s);
    kmp_text_free(&sentence);
}

static bool same_column(const column *a, const column *b)
{
    return a->kind == b->kind && a->kind >= COLUMN_TIME && a->quantity == b->quantity && a->index == b->index;
}

static bool stands_before(const reader *r, const column *c)
{
    int k = c->kind < COLUMN_TIME ? r->column_count : 0;
    while (k < r->column_count && !same_column(c, &r->columns[k]))
        k++;
    return k < r->column_count;
}

/* True for columns of computed outputs, "velocity.crank.B.x", and of inverse dynamics' generalized forces. */
static bool is_computed(field f)
{
    static const char *const others[] = {"tau", "power"};
    const size_t rows = sizeof kmp_output_rows / sizeof *kmp_output_rows, more = sizeof others / sizeof *others;
    for (size_t k = 0; k < rows + more; k++) {
        const char *word = k < rows ? kmp_output_rows[k].word : others[k - rows];
        size_t length = strlen(word);
        bool here = k >= rows || kmp_output_rows[k].width > 0;
        if (here && f.length > length + 1 && f.s[length] == '.' && memcmp(f.s, word, length) == 0)
            return true;
    }
    return false;
}

static column resolve(reader *r, field f)
{
    char known[128];
    kmp_text name = {0};
    kmp_text_printf(&name, "%.*s", (int)f.length, f.s);
    column c = {.kind = COLUMN_UNKNOWN};
    if (is(f, "t")) {
        c.kind = COLUMN_TIME;
    } else if (is_computed(f)) {
        c.kind = COLUMN_PASSED;
    } else if (!name.failed) {
        kmp_nearest nearest = kmp_nearest_begin(name.s);
        c = find_column(r, name.s, &nearest, known, sizeof known);
        if (c.kind == COLUMN_UNKNOWN)
            complain_column(r, f.s, name.s, &nearest);
    }
    r->failed = r->failed || name.failed;
    kmp_text_free(&name);
    return c;
}

static bool read_header(reader *r)
{
    bool time = false;
    size_t commas = 0;
    for (const char *s = r->line_text; *s; s++)
        commas += *s == ',';
    r->columns = KMP_NEW(column, commas + 1);
    if (!r->columns)
        return false;
    for (const char *s = r->line_text; s && r->complaints < MOST_COMPLAINTS;) {
        field f = next_field(&s);
        column *c = &r->columns[r->column_count];
        *c = resolve(r, f);
        if (stands_before(r, c))
            complain(r, f.s, "duplicate column");
        time = time || c->kind == COLUMN_TIME;
        r->column_count++;
    }
    if (!time)
        complain(r, r->line_text, "column t is missing");
    return true;
}

/* -- rows -------------------------------------------------------------------------------------------- */

static void take_time(reader *r, field f)
{
    kmp_reference *reference = r->reference;
    double *t = &reference->t[reference->rows];
    if (!to_number(f, t))
        complain(r, f.s, "a time is expected here");
    else if (*t < 0)
        complain(r, f.s, "times begin at 0");
    else if (reference->rows > 0 && *t <= t[-1])
        complain(r, f.s, "times must increase from row to row");
}

static void take_value(reader *r, const column *c, field f)
{
    size_t width = (size_t)kmp_quantity_size(r->system, c->quantity);
    double *value = &r->reference->value[c->quantity][(size_t)r->reference->rows * width + (size_t)c->index];
    if (f.length > 0 && !to_number(f, value))
        complain(r, f.s, "this is not a number; write a number, or leave the field empty");
}

static void read_row(reader *r)
{
    int k = 0;
    for (const char *s = r->line_text; s; k++) {
        field f = next_field(&s);
        if (k >= r->column_count)
            continue;
        if (r->columns[k].kind == COLUMN_TIME)
            take_time(r, f);
        else if (r->columns[k].kind == COLUMN_VALUE)
            take_value(r, &r->columns[k], f);
    }
    if (k != r->column_count) {
        kmp_text sentence = {0};
        kmp_text_printf(&sentence, "%d fields where the header has %d columns", k, r->column_count);
        complain(r, r->line_text, sentence.failed ? "wrong number of fields" : sentence.s);
        kmp_text_free(&sentence);
    }
    r->reference->rows++;
}

static bool is_passed_over(const char *line)
{
    while (is_blank(*line))
        line++;
    return *line == '#' || *line == '\0';
}

static bool make_room(reader *r)
{
    const int width[KMP_QUANTITIES] = {r->system->n, r->system->n, r->system->n, r->system->m};
    int more = r->room ? 2 * r->room : 64;
    if (r->reference->rows < r->room)
        return true;
    if (!reserve(r->reference, width, r->room, more))
        return false;
    r->room = more;
    return true;
}

/* Divides the text into lines, up to the last error that is reported. False: no memory. */
static bool read_lines(reader *r, char *text)
{
    if (strncmp(text, "\xef\xbb\xbf", 3) == 0)
        text += 3; /* byte order mark */
    for (char *s = text; s && r->complaints < MOST_COMPLAINTS;) {
        char *end = strchr(s, '\n');
        if (end)
            *end = '\0';
        r->line++;
        r->line_text = s;
        s = end ? end + 1 : NULL;
        if (is_passed_over(r->line_text))
            continue;
        bool header = !r->columns;
        if (!(header ? read_header(r) : make_room(r)))
            return false;
        if (!header)
            read_row(r);
    }
    if (!r->columns) {
        r->line_text = "";
        complain(r, r->line_text, "the header line is missing; it begins with t");
    }
    return true;
}

kempe_status kmp_reference_read(const kempe_system *system, const char *path, kmp_reference *reference)
{
    char *text;
    size_t length;
    kempe_status status = kmp_file_read(system->context, path, &text, &length);
    if (status != KEMPE_OK)
        return status;
    kmp_reference made = {0};
    reader r = {.system = system, .path = path, .reference = &made};
    if (!make_room(&r) || !read_lines(&r, text) || r.failed)
        status = kmp_fail_memory(system->context);
    else if (r.complaints > 0)
        status = KEMPE_E_INPUT;
    kmp_free(r.columns);
    kmp_free(text);
    if (status != KEMPE_OK)
        kmp_reference_free(&made);
    else
        *reference = made;
    return status;
}
