/* SPDX-License-Identifier: BSD-3-Clause */
/* A sample is a point of a design, given the correlations as normal scores (Gaussian copula), and then the quantiles of
 * its distributions. */
#include "ensemble/sampling/sampling.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "ensemble/sampling/model_instances.h"
#include "model/data/model.h"
#include "model/data/variant.h"
#include "model/language/ranges.h"
#include "output/print.h"
#include <ctype.h>
#include <limits.h>
#include <math.h>
#include <string.h>

enum { MOST_NUMBERS = 4 };

/* -- reading of one quantity ------------------------------------------------------------------------- */

/* The words after NAME=, a function of numbers. */
typedef struct words {
    const char *form, *usage;
    int least, most; /* numbers */
} words;

typedef struct reader {
    kmp_sampling *s;
    kempe_context *context;
    const char *entry; /* NAME=..., for messages */
} reader;

static kempe_status refuse(const reader *r, const char *why)
{
    return kmp_fail(r->context, KEMPE_E_ARGUMENT, "'%s': %s", r->entry, why);
}

/* The numbers between parentheses, each with or without a unit. */
static kempe_status read_numbers(const reader *r, const char *name, const char *text, const words *w, double *x,
                                 int *count)
{
    size_t length = strlen(text);
    *count = 0;
    if (length < 2 || text[length - 1] != ')')
        return kmp_fail(r->context, KEMPE_E_ARGUMENT, "'%s': '%s' is expected", r->entry, w->usage);
    const char *s = text, *end = text + length - 1;
    while (s < end) {
        size_t size = strcspn(s, ",)");
        if (*count == w->most)
            return kmp_fail(r->context, KEMPE_E_ARGUMENT, "'%s': '%s' is expected", r->entry, w->usage);
        while (size > 0 && *s == ' ') {
            s++;
            size--;
        }
        kmp_text one = {0};
        kmp_ranges value = {0};
        kmp_text_printf(&one, "%s=%.*s", name, (int)size, s);
        kempe_status status = one.failed ? kmp_fail_memory(r->context) : kmp_ranges_read(r->context, one.s, &value);
        kmp_text_free(&one);
        KMP_TRY(status);
        bool single = value.count == 1 && value.range[0].count == 1;
        x[(*count)++] = value.range[0].from;
        kmp_ranges_free(&value);
        if (!single)
            return refuse(r, "numbers between commas are expected in the parentheses");
        s += size + (s[size] == ',');
    }
    if (*count != w->least && *count != w->most)
        return kmp_fail(r->context, KEMPE_E_ARGUMENT, "'%s': '%s' is expected", r->entry, w->usage);
    return KEMPE_OK;
}

static kempe_status take_normal(const reader *r, int count, const double *x, kmp_distribution *d)
{
    *d = (kmp_distribution){KMP_NORMAL, count > 2 ? x[2] : -INFINITY, count > 2 ? x[3] : INFINITY, x[0], x[1]};
    if (!(d->width > 0))
        return refuse(r, "the standard deviation must be positive");
    if (!(d->least < d->most))
        return refuse(r, "the least value must be below the largest one");
    double above = kmp_normal_share((d->centre - d->most) / d->width);
    double below = kmp_normal_share((d->least - d->centre) / d->width);
    return 1 - above - below > KMP_TRUNCATED_LEAST
               ? KEMPE_OK
               : refuse(r, "almost nothing of the distribution lies between its limits");
}

static kempe_status take_triangular(const reader *r, const double *x, kmp_distribution *d)
{
    *d = (kmp_distribution){.kind = KMP_TRIANGULAR, .least = x[0], .centre = x[1], .most = x[2]};
    return d->least <= d->centre && d->centre <= d->most && d->least < d->most
               ? KEMPE_OK
               : refuse(r, "the least, the most frequent and the largest value must be in this order");
}

/* "IT7", "IT7(uniform)": about the model's own value. */
static kempe_status take_grade(const reader *r, const char *name, const char *text, kmp_distribution *d)
{
    int at = kmp_parameter_find(r->s->model, name), grade = 0;
    const char *s = text + 2;
    while (isdigit((unsigned char)*s) && grade < 100)
        grade = 10 * grade + (*s++ - '0');
    bool uniform = strcmp(s, "(uniform)") == 0;
    if ((*s && !uniform && strcmp(s, "(normal)") != 0) || grade < KMP_GRADE_LEAST || grade > KMP_GRADE_MOST)
        return refuse(r, "grades of ISO 286 are IT5 to IT18, as 'IT7' or 'IT7(uniform)'");
    if (at < 0)
        return refuse(r, "a grade of ISO 286 applies to a parameter of the model, a length");
    double size = r->s->model->parameters[at].number.value, tolerance = kmp_tolerance_grade(grade, size);
    if (tolerance == 0)
        return kmp_fail(r->context, KEMPE_E_ARGUMENT, "'%s': ISO 286 has sizes above 0 and up to 3.15 m, not %.6g m",
                        r->entry, size);
    *d = (kmp_distribution){uniform ? KMP_UNIFORM : KMP_NORMAL, size - tolerance / 2, size + tolerance / 2, size,
                            tolerance / 6};
    return KEMPE_OK;
}

static kempe_status take_range(const reader *r, kmp_sampled_column *c)
{
    kmp_ranges range = {0};
    KMP_TRY(kmp_ranges_read(r->context, r->entry, &range));
    const kmp_range *x = &range.range[0];
    c->d = (kmp_distribution){.kind = KMP_UNIFORM, .least = x->from, .most = x->to};
    c->levels = x->count;
    kmp_ranges_free(&range);
    if (c->levels == 1)
        return kmp_fail(r->context, KEMPE_E_ARGUMENT, "sampling '%s' needs a range NAME=A:B or a distribution",
                        c->name);
    return KEMPE_OK;
}

static kempe_status read_column(const reader *r, kmp_sampled_column *c)
{
    static const words normal = {"normal(", "NAME=normal(MEAN, DEVIATION) or NAME=normal(MEAN, DEVIATION, LEAST, MOST)",
                                 2, 4};
    static const words triangular = {"triangular(", "NAME=triangular(LEAST, MODE, MOST)", 3, 3};
    const char *value = strchr(r->entry, '=');
    double x[MOST_NUMBERS];
    int count;
    if (!value || value == r->entry)
        return take_range(r, c); /* whose message has the form of ranges */
    kmp_text name = {0};
    kmp_text_printf(&name, "%.*s", (int)(value - r->entry), r->entry);
    c->name = name.failed ? NULL : kmp_arena_strdup(&r->s->arena, name.s);
    kmp_text_free(&name);
    KMP_TRY(kmp_made(r->context, c->name));
    kmp_text why = {0};
    if (!kmp_instance_may(r->s->model, c->name, &why))
        return kmp_fail_text(r->context, KEMPE_E_ARGUMENT, &why);
    value++;
    if (strncmp(value, normal.form, strlen(normal.form)) == 0) {
        KMP_TRY(read_numbers(r, c->name, value + strlen(normal.form), &normal, x, &count));
        return take_normal(r, count, x, &c->d);
    }
    if (strncmp(value, triangular.form, strlen(triangular.form)) == 0) {
        KMP_TRY(read_numbers(r, c->name, value + strlen(triangular.form), &triangular, x, &count));
        return take_triangular(r, x, &c->d);
    }
    if (strncmp(value, "IT", 2) == 0)
        return take_grade(r, c->name, value, &c->d);
    return take_range(r, c);
}

/* -- all of them ------------------------------------------------------------------------------------- */

static kempe_status read_columns(kmp_sampling *s, const char *text)
{
    kempe_context *context = s->model->context;
    int most = 1;
    for (const char *c = text; *c; c++)
        most += *c == ',';
    s->column = KMP_ARENA_NEW(&s->arena, kmp_sampled_column, most);
    s->name = KMP_ARENA_NEW(&s->arena, const char *, most);
    KMP_TRY(kmp_made(context, !s->arena.failed));
    for (const char *c = text;; c++) {
        c += strspn(c, " ");
        /* The length of an entry: up to a comma outside parentheses. */
        size_t length = 0;
        for (int depth = 0; c[length] && (c[length] != ',' || depth > 0); length++)
            depth += (c[length] == '(') - (c[length] == ')');
        kmp_text entry = {0};
        kmp_text_printf(&entry, "%.*s", (int)length, c);
        KMP_TRY(kmp_made(context, !entry.failed));
        kmp_sampled_column *made = &s->column[s->columns];
        kempe_status status = read_column(&(reader){s, context, entry.s}, made);
        kmp_text_free(&entry);
        KMP_TRY(status);
        s->name[s->columns++] = made->name;
        c += length;
        if (!*c)
            return KEMPE_OK;
    }
}

static int column_of(const kmp_sampling *s, const char *name, size_t length)
{
    for (int k = 0; k < s->columns; k++)
        if (strlen(s->name[k]) == length && strncmp(s->name[k], name, length) == 0)
            return k;
    return -1;
}

/* Factors the correlations. */
static kempe_status correlate(kmp_sampling *s, const char *text)
{
    int n = s->columns;
    double *a = s->factor = KMP_ARENA_NEW(&s->arena, double, (size_t)n *(size_t)n);
    KMP_TRY(kmp_made(s->model->context, a));
    for (int k = 0; k < n; k++)
        a[k * n + k] = 1;
    /* "a:b=0.8,a:c=-0.2": the correlations of normal scores. */
    for (const char *c = text; *c; c += *c == ',') {
        c += strspn(c, " ");
        size_t length = strcspn(c, ","), first = strcspn(c, ":=,"),
               second = c[first] == ':' ? strcspn(c + first + 1, "=,") : 0;
        int i = column_of(s, c, first), j = second ? column_of(s, c + first + 1, second) : -1;
        const char *value = second ? c + first + 1 + second : c;
        double x = 0;
        size_t sign = *value == '=' && (value[1] == '-' || value[1] == '+');
        size_t digits = *value == '=' ? kmp_text_to_number(value + 1 + sign, &x) : 0;
        if (digits == 0 || value + 1 + sign + digits != c + length || i < 0 || j < 0 || i == j || !(x < 1))
            return kmp_fail(s->model->context, KEMPE_E_ARGUMENT,
                            "'%.*s': a correlation is written NAME:NAME=R with two different names of --sample and R "
                            "between -1 and 1",
                            (int)length, c);
        a[i * s->columns + j] = a[j * s->columns + i] = value[1] == '-' ? -x : x;
        c += length;
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = a[i * n + j];
            for (int k = 0; k < j; k++)
                sum -= a[i * n + k] * a[j * n + k];
            if (i == j && !(sum > KMP_CORRELATION_LEAST))
                return kmp_fail(s->model->context, KEMPE_E_ARGUMENT,
                                "correlations: those of '%s' with the others contradict each other", s->name[i]);
            a[i * n + j] = i == j ? sqrt(sum) : sum / a[j * n + j];
        }
    return KEMPE_OK;
}

static kempe_status make(kmp_sampling *s, const kempe_sample_options *options)
{
    kempe_context *context = s->model->context;
    const char *word = options->design ? options->design : "random";
    if (!kmp_design_find(word, &s->design))
        return kmp_fail(context, KEMPE_E_ARGUMENT,
                        "unknown design '%s'; there are random, latin, sobol, saltelli and grid", word);
    KMP_TRY(read_columns(s, options->ranges));
    for (int k = 0; s->design != KMP_DESIGN_GRID && k < s->columns; k++)
        if (s->column[k].levels > 1)
            return kmp_fail(context, KEMPE_E_ARGUMENT,
                            "'%s': a number of values belongs to --design grid; use NAME=A:B", s->name[k]);
    if (s->design == KMP_DESIGN_SOBOL && s->columns > KMP_SOBOL_MOST)
        return kmp_fail(context, KEMPE_E_ARGUMENT, "a Sobol sequence has at most %d columns", KMP_SOBOL_MOST);
    if (options->correlations && *options->correlations) {
        if (s->design == KMP_DESIGN_GRID)
            return kmp_fail(context, KEMPE_E_ARGUMENT, "a grid has no correlations");
        if (s->design == KMP_DESIGN_SALTELLI)
            return kmp_fail(context, KEMPE_E_ARGUMENT,
                            "Sobol's indices are those of independent quantities: the design saltelli has no "
                            "correlations");
        KMP_TRY(correlate(s, options->correlations));
    }
    if (s->design == KMP_DESIGN_GRID) {
        /* The number of samples of a full factorial grid. */
        long count = 1;
        for (int k = 0; k < s->columns; k++) {
            const kmp_sampled_column *c = &s->column[k];
            if (c->d.kind != KMP_UNIFORM || c->levels < 2)
                return kmp_fail(s->model->context, KEMPE_E_ARGUMENT,
                                "'%s': a grid needs a range with a number of values, NAME=A:B:N", c->name);
            count *= c->levels;
            if (count > INT_MAX)
                return kmp_fail(s->model->context, KEMPE_E_ARGUMENT, "the grid has more than %d instances", INT_MAX);
        }
        s->count = (int)count;
        return KEMPE_OK;
    }
    s->count = options->count ? options->count : 1000;
    if (s->design == KMP_DESIGN_SALTELLI) { /* whole groups */
        int group = kmp_saltelli_group(s->columns);
        s->count = (s->count + group - 1) / group * group;
    }
    return s->count > 0 ? KEMPE_OK
                        : kmp_fail(context, KEMPE_E_ARGUMENT, "the number of instances must be at least one");
}

kempe_status kmp_sampling_new(const kempe_model *model, const kempe_sample_options *options, kmp_sampling **sampling)
{
    KMP_MAKE(model->context, kmp_sampling, s);
    s->model = model;
    s->seed = options->seed ? (uint64_t)options->seed : 1;
    kempe_status status = make(s, options);
    return KMP_GIVE_OR_FREE(status, sampling, s, kmp_sampling_free);
}

KMP_FREES(kmp_sampling, s, kmp_arena_free(&s->arena))

/* -- samples ----------------------------------------------------------------------------------------- */

void kmp_sampling_row(const kmp_sampling *s, int k, double *row)
{
    int n = s->columns;
    if (s->design == KMP_DESIGN_GRID) { /* the last column varies fastest */
        for (int c = s->columns; c-- > 0;) {
            const kmp_sampled_column *x = &s->column[c];
            row[c] = kmp_range_value(&(kmp_range){.from = x->d.least, .to = x->d.most}, k % x->levels, x->levels);
            k /= x->levels;
        }
        return;
    }
    for (int c = 0; c < n; c++)
        row[c] = kmp_design_point(s->design, s->seed, (uint64_t)k, (uint64_t)s->count, c, n);
    for (int c = 0; s->factor && c < n; c++)
        row[c] = kmp_normal_quantile(row[c]);
    for (int c = n; s->factor && c-- > 0;) {
        double score = 0;
        for (int i = 0; i <= c; i++)
            score += s->factor[c * n + i] * row[i];
        row[c] = fmin(fmax(kmp_normal_share(score), 0x1p-60), 1 - 0x1p-53);
    }
    for (int c = 0; c < n; c++)
        row[c] = kmp_distribution_quantile(&s->column[c].d, row[c]);
}
