/* SPDX-License-Identifier: BSD-3-Clause */
/* A sample is a point of a design, given the correlations as normal scores (Gaussian copula), and then the quantiles of
 * its distributions. */
#include "ensemble/sampling/sampling.h"
#include "analyses/parts/ranges.h"
#include "base/memory.h"
#include "constraints/tolerances.h"
#include "ensemble/sampling/model_instances.h"
#include "model/data/model_context.h"
#include "model/data/parameter.h"
#include "model/data/variant.h"
#include <ctype.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

/* The design of a word of designs; false: there is none of it. */
static bool find_design(const char *word, kmp_design *design)
{
    static const char *const words[] = {[KMP_DESIGN_RANDOM] = "random",
                                        [KMP_DESIGN_LATIN] = "latin",
                                        [KMP_DESIGN_SOBOL] = "sobol",
                                        [KMP_DESIGN_SALTELLI] = "saltelli",
                                        [KMP_DESIGN_GRID] = "grid"};
    for (int k = 0; k <= KMP_DESIGN_GRID; k++)
        if (strcmp(word, words[k]) == 0) {
            *design = (kmp_design)k;
            return true;
        }
    return false;
}

/* -- random numbers by their place -------------------------------------------------------------------- */

/* Without a state: Philox 4x64 of 10 rounds (Salmon, Moraes, Dror, Shaw, Parallel random numbers: as easy as 1, 2, 3,
 * SC11, 2011). */
enum { ROUNDS = 10 };

/* The upper half of a product; *low: the lower one. */
static uint64_t product(uint64_t a, uint64_t b, uint64_t *low)
{
    __extension__ typedef unsigned __int128 wide;
    wide p = (wide)a * b;
    *low = (uint64_t)p;
    return (uint64_t)(p >> 64);
}

/* The four numbers of a counter under a key. */
static void philox(const uint64_t key[2], const uint64_t counter[4], uint64_t x[4])
{
    uint64_t k0 = key[0], k1 = key[1];
    for (int i = 0; i < 4; i++)
        x[i] = counter[i];
    for (int round = 0; round < ROUNDS; round++) {
        uint64_t low0, low2, high0 = product(0xD2E7470EE14C6C93u, x[0], &low0),
                             high2 = product(0xCA5A826395121157u, x[2], &low2);
        x[0] = high2 ^ x[1] ^ k0;
        x[1] = low2;
        x[2] = high0 ^ x[3] ^ k1;
        x[3] = low0;
        k0 += 0x9E3779B97F4A7C15u;
        k1 += 0xBB67AE8584CAA73Bu;
    }
}

/* A whole number of 64 bits: the number at place (i, j) of the stream of a seed. */
static uint64_t chance_bits(uint64_t seed, uint64_t stream, uint64_t i, uint64_t j)
{
    uint64_t numbers[4];
    philox((const uint64_t[]){seed, stream}, (const uint64_t[]){i, j, 0, 0}, numbers);
    return numbers[0];
}

/* A number in (0, 1), in the middle of one of 2^52 equal intervals. */
static double chance_at(uint64_t seed, uint64_t stream, uint64_t i, uint64_t j)
{
    return ((double)(chance_bits(seed, stream, i, j) >> 12) + 0.5) * 0x1p-52;
}

/* Streams of random numbers of one seed. */
enum { STREAM_POINTS, STREAM_ORDER };

/* -- Latin hypercube --------------------------------------------------------------------------------- */

/* A permutation of 0 .. count - 1, different for each column: a Feistel network of four rounds on the least even number
 * of bits that count - 1 fits into, applied until the result is below count (cycle walking; Black, Rogaway, Ciphers
 * with arbitrary finite domains, CT-RSA 2002). */
static uint64_t permuted(uint64_t seed, uint64_t k, uint64_t count, int column)
{
    int half = 1;
    while (half < 32 && (count - 1) >> (2 * half))
        half++;
    uint64_t mask = ((uint64_t)1 << half) - 1;
    do {
        uint64_t left = k >> half, right = k & mask;
        for (uint64_t round = 0; round < 4; round++) {
            uint64_t turned = chance_bits(seed, STREAM_ORDER, right, (uint64_t)column * 4 + round) & mask;
            uint64_t next = left ^ turned;
            left = right;
            right = next;
        }
        k = left << half | right;
    } while (k >= count);
    return k;
}

/* -- Sobol ------------------------------------------------------------------------------------------- */

typedef struct sobol_row {
    unsigned degree, coefficients;
    uint32_t first[18];
} sobol_row;

static const sobol_row sobol_rows[KMP_SOBOL_MOST] = {
    {0},
#define KMP_SOBOL(degree, coefficients, ...) {degree, coefficients, {__VA_ARGS__}},
#include "ensemble/sampling/sobol.def"
#undef KMP_SOBOL
};

/* Direction number i of a column, i from 0, by the recurrence of Bratley and Fox (ACM TOMS 14 (1988) 88). */
static uint32_t direction(const sobol_row *row, int i, uint32_t *v)
{
    int degree = (int)row->degree;
    if (degree == 0)
        return v[i] = (uint32_t)1 << (31 - i);
    if (i < degree)
        return v[i] = row->first[i] << (31 - i);
    uint32_t x = v[i - degree] ^ (v[i - degree] >> degree);
    for (int j = 1; j < degree; j++)
        if (row->coefficients >> (degree - 1 - j) & 1)
            x ^= v[i - j];
    return v[i] = x;
}

/* Point k is the sum of the direction numbers of the bits of its Gray code (Antonov, Saleev, 1979). */
static uint32_t sobol_point(uint64_t k, int column)
{
    uint32_t x = 0, v[32], gray = (uint32_t)(k ^ (k >> 1));
    for (int i = 0; i < 32 && gray >> i; i++) {
        uint32_t d = direction(&sobol_rows[column], i, v);
        x ^= gray >> i & 1 ? d : 0;
    }
    return x;
}

double kmp_design_point(kmp_design design, uint64_t seed, uint64_t k, uint64_t count, int column, int columns)
{
    if (design == KMP_DESIGN_SALTELLI) {
        /* The two points of a group have separate places in the stream. */
        uint64_t size = (uint64_t)kmp_saltelli_group(columns), group = k / size;
        int member = (int)(k % size);
        bool second = member == 1 || member == 2 + column;
        return chance_at(seed, STREAM_POINTS, group, (uint64_t)(second ? columns + column : column));
    }
    double chance = design == KMP_DESIGN_SOBOL ? 0.5 : chance_at(seed, STREAM_POINTS, k, (uint64_t)column);
    if (design == KMP_DESIGN_LATIN)
        return ((double)permuted(seed, k, count, column) + chance) / (double)count;
    if (design == KMP_DESIGN_SOBOL)
        return (sobol_point(k, column) + 0.5) * 0x1p-32;
    return chance;
}

double kmp_normal_share(double z)
{
    return 0.5 * erfc(-z * 0.70710678118654752440);
}

/* Halley's iteration on the share of the nearer tail, from a fit of 4e-4 (Abramowitz, Stegun, 26.2.23). */
double kmp_normal_quantile(double part)
{
    double tail = part < 0.5 ? part : 1 - part, r = sqrt(-2 * log(tail));
    double z = r - (2.515517 + r * (0.802853 + r * 0.010328)) / (1 + r * (1.432788 + r * (0.189269 + r * 0.001308)));
    for (int k = 0; k < 3; k++) {
        double density = 0.39894228040143267794 * exp(-0.5 * z * z);
        double step = (kmp_normal_share(-z) - tail) / density;
        z += step / (1 - 0.5 * z * step);
    }
    return part < 0.5 ? -z : z;
}

static double normal(const kmp_distribution *d, double part)
{
    double below = kmp_normal_share((d->least - d->centre) / d->width);
    double above = kmp_normal_share((d->centre - d->most) / d->width);
    double z = kmp_normal_quantile(below + part * (1 - below - above));
    return fmin(fmax(d->centre + d->width * z, d->least), d->most);
}

static double triangular(const kmp_distribution *d, double part)
{
    double size = d->most - d->least, rise = d->centre - d->least;
    return part * size < rise ? d->least + sqrt(part * size * rise)
                              : d->most - sqrt((1 - part) * size * (d->most - d->centre));
}

/* The value below which the share `part` of all values lies, 0 < part < 1. */
static double quantile_of(const kmp_distribution *d, double part)
{
    switch (d->kind) {
    case KMP_NORMAL:
        return normal(d, part);
    case KMP_TRIANGULAR:
        return triangular(d, part);
    case KMP_UNIFORM:
        break;
    }
    return d->least + part * (d->most - d->least);
}

/* -- ISO 286-1 --------------------------------------------------------------------------------------- */

/* Standard tolerances in micrometres of IT5 to IT18, up to and including a size in mm (ISO 286-1:2010, table 1). */
static const struct {
    double size;
    int tolerance[KMP_GRADE_MOST - KMP_GRADE_LEAST + 1];
} grades[] = {
    {3, {4, 6, 10, 14, 25, 40, 60, 100, 140, 250, 400, 600, 1000, 1400}},
    {6, {5, 8, 12, 18, 30, 48, 75, 120, 180, 300, 480, 750, 1200, 1800}},
    {10, {6, 9, 15, 22, 36, 58, 90, 150, 220, 360, 580, 900, 1500, 2200}},
    {18, {8, 11, 18, 27, 43, 70, 110, 180, 270, 430, 700, 1100, 1800, 2700}},
    {30, {9, 13, 21, 33, 52, 84, 130, 210, 330, 520, 840, 1300, 2100, 3300}},
    {50, {11, 16, 25, 39, 62, 100, 160, 250, 390, 620, 1000, 1600, 2500, 3900}},
    {80, {13, 19, 30, 46, 74, 120, 190, 300, 460, 740, 1200, 1900, 3000, 4600}},
    {120, {15, 22, 35, 54, 87, 140, 220, 350, 540, 870, 1400, 2200, 3500, 5400}},
    {180, {18, 25, 40, 63, 100, 160, 250, 400, 630, 1000, 1600, 2500, 4000, 6300}},
    {250, {20, 29, 46, 72, 115, 185, 290, 460, 720, 1150, 1850, 2900, 4600, 7200}},
    {315, {23, 32, 52, 81, 130, 210, 320, 520, 810, 1300, 2100, 3200, 5200, 8100}},
    {400, {25, 36, 57, 89, 140, 230, 360, 570, 890, 1400, 2300, 3600, 5700, 8900}},
    {500, {27, 40, 63, 97, 155, 250, 400, 630, 970, 1550, 2500, 4000, 6300, 9700}},
    {630, {32, 44, 70, 110, 175, 280, 440, 700, 1100, 1750, 2800, 4400, 7000, 11000}},
    {800, {36, 50, 80, 125, 200, 320, 500, 800, 1250, 2000, 3200, 5000, 8000, 12500}},
    {1000, {40, 56, 90, 140, 230, 360, 560, 900, 1400, 2300, 3600, 5600, 9000, 14000}},
    {1250, {47, 66, 105, 165, 260, 420, 660, 1050, 1650, 2600, 4200, 6600, 10500, 16500}},
    {1600, {55, 78, 125, 195, 310, 500, 780, 1250, 1950, 3100, 5000, 7800, 12500, 19500}},
    {2000, {65, 92, 150, 230, 370, 600, 920, 1500, 2300, 3700, 6000, 9200, 15000, 23000}},
    {2500, {78, 110, 175, 280, 440, 700, 1100, 1750, 2800, 4400, 7000, 11000, 17500, 28000}},
    {3150, {96, 135, 210, 330, 540, 860, 1350, 2100, 3300, 5400, 8600, 13500, 21000, 33000}},
};

/* The tolerance of a nominal size by a grade of ISO 286-1, 5 to 18, in m; 0: the size is not above 0, or above 3.15 m.
 */
static double tolerance_grade(int grade, double size)
{
    for (size_t k = 0; size > 0 && k < sizeof grades / sizeof *grades; k++)
        if (size * 1e3 <= grades[k].size * (1 + 4 * DBL_EPSILON))
            return grades[k].tolerance[grade - KMP_GRADE_LEAST] * 1e-6;
    return 0;
}

/* -- samples ------------------------------------------------------------------------------------------------ */

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
        KMP_TRY(kmp_range_of_variable(r->s->model, "sampling", name, s, size, &x[(*count)++]));
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
    double size = kmp_model_parameter(r->s->model, at)->number.value, tolerance = tolerance_grade(grade, size);
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
    kempe_status fits = kmp_range_fits_variable(r->s->model, "sampling", x);
    c->d = (kmp_distribution){.kind = KMP_UNIFORM, .least = x->from, .most = x->to};
    c->levels = x->count;
    kmp_ranges_free(&range);
    KMP_TRY(fits);
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
    kempe_context *context = kmp_model_context(s->model);
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
    kempe_context *context = kmp_model_context(s->model);
    KMP_TRY(kmp_made(context, a));
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
            return kmp_fail(context, KEMPE_E_ARGUMENT,
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
                return kmp_fail(context, KEMPE_E_ARGUMENT,
                                "the correlations of '%s' with the others contradict each other", s->name[i]);
            a[i * n + j] = i == j ? sqrt(sum) : sum / a[j * n + j];
        }
    return KEMPE_OK;
}

static kempe_status make(kmp_sampling *s, const kempe_sample_options *options)
{
    kempe_context *context = kmp_model_context(s->model);
    const char *word = options->design ? options->design : "random";
    if (!find_design(word, &s->design))
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
                            "Sobol's indices need independent quantities: the design saltelli has no correlations");
        KMP_TRY(correlate(s, options->correlations));
    }
    if (s->design == KMP_DESIGN_GRID) {
        /* The number of samples of a full factorial grid. */
        long count = 1;
        for (int k = 0; k < s->columns; k++) {
            const kmp_sampled_column *c = &s->column[k];
            if (c->d.kind != KMP_UNIFORM || c->levels < 2)
                return kmp_fail(kmp_model_context(s->model), KEMPE_E_ARGUMENT,
                                "'%s': a grid needs a range with a number of values, NAME=A:B:N", c->name);
            count *= c->levels;
            if (count > INT_MAX)
                return kmp_fail(kmp_model_context(s->model), KEMPE_E_ARGUMENT, "the grid has more than %d instances",
                                INT_MAX);
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
    KMP_MAKE(kmp_model_context(model), kmp_sampling, s);
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
        row[c] = quantile_of(&s->column[c].d, row[c]);
}
