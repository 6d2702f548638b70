/* SPDX-License-Identifier: BSD-3-Clause */
/* Lines of a tyre property file are [SECTION], KEY = value or KEY = 'word'; $ and ! begin comments, and braces a head
 * of a table. Numbers are in the units of the section UNITS. The form of the equations follows from FITTYP, or from
 * PROPERTY_FILE_FORMAT. */
#include "road/model/tir_file.h"
#include "base/memory.h"
#include "model/read/read_include.h"
#include "model/read/read_tables.h"
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef enum tir_dimension {
    TIR_NUMBER,
    TIR_FORCE,
    TIR_LENGTH,
    TIR_STIFFNESS,
    TIR_DAMPING,
    TIR_SPEED,
    TIR_ANGLE
} tir_dimension;

static const struct {
    const char *key;
    double absent;
    bool required;
    tir_dimension dimension;
} rows[KMP_TIR_COUNT] = {
#define KMP_TIR(name, absent, required, dimension) {#name, absent, required, TIR_##dimension},
#include "model/data/tir_keys.def"
#undef KMP_TIR
};

/* Words of the section UNITS. */
enum { LENGTH, FORCE, ANGLE, TIME, MASS, UNITS };
static const char *const unit_keys[UNITS] = {"LENGTH", "FORCE", "ANGLE", "TIME", "MASS"};
static const struct {
    int key;
    const char *words;
    double si;
} units[] = {{LENGTH, "meter m", 1},
             {LENGTH, "mm millimeter", 1e-3},
             {LENGTH, "cm", 1e-2},
             {LENGTH, "inch", 0.0254},
             {LENGTH, "foot", 0.3048},
             {FORCE, "newton n", 1},
             {FORCE, "kilonewton kn", 1e3},
             {FORCE, "pound_force", 4.4482216152605},
             {ANGLE, "radian radians rad", 1},
             {ANGLE, "degree degrees deg", 0.017453292519943295},
             {TIME, "second s sec", 1},
             {TIME, "millisecond", 1e-3},
             {MASS, "kg", 1},
             {MASS, "gram", 1e-3},
             {MASS, "pound_mass", 0.45359237}};

/* A file being read. */
typedef struct source {
    kmp_reader *r;
    const char *what;
    kmp_tir_file *tir;
    kmp_place place;    /* of the present line */
    double unit[UNITS]; /* in SI */
    int fit;            /* FITTYP; -1: not given */
    char format[32], section[40];
    double inflated, nominal; /* pressures, in the unit of the file; 0: not given */
    bool pressed;             /* it has coefficients of the pressure */
    bool good, skips;         /* skips: the rows of a table follow */
    kmp_text unused;
    int unused_count;
} source;

#define COMPLAIN(s, ...) ((s)->good = KMP_COMPLAIN(s, &(kmp_yaml){.place = (s)->place}, __VA_ARGS__))

static bool is_equal(const char *a, const char *b)
{
    for (; *a && *b; a++, b++)
        if (tolower((unsigned char)*a) != tolower((unsigned char)*b))
            return false;
    return *a == *b;
}

static void read_unit(source *s, const char *key, char *word)
{
    for (char *c = word; *c; c++)
        *c = (char)tolower((unsigned char)*c);
    for (size_t k = 0; k < sizeof units / sizeof *units; k++)
        if (is_equal(key, unit_keys[units[k].key]) && kmp_text_behind_word(units[k].words, word)) {
            s->unit[units[k].key] = units[k].si;
            return;
        }
    COMPLAIN(s, "unknown unit '%s'", word);
}

static double unit_of(const source *s, tir_dimension dimension)
{
    const double length = s->unit[LENGTH], force = s->unit[FORCE], time = s->unit[TIME];
    const double of[] = {[TIR_NUMBER] = 1,
                         [TIR_FORCE] = force,
                         [TIR_LENGTH] = length,
                         [TIR_STIFFNESS] = force / length,
                         [TIR_DAMPING] = force * time / length,
                         [TIR_SPEED] = length / time,
                         [TIR_ANGLE] = s->unit[ANGLE]};
    return of[dimension];
}

/* Adds a key or a section that the equations do not use to the list of the first ones. */
static void add_unused(source *s, const char *before, const char *name, const char *behind)
{
    if (s->unused_count > 0 && s->unused_count < KMP_TIR_FIRST_UNUSED)
        kmp_text_put(&s->unused, ", ");
    if (s->unused_count++ < KMP_TIR_FIRST_UNUSED)
        kmp_text_printf(&s->unused, "%s%s%s", before, name, behind);
}

/* A word of the section MODEL or the head; true: it is one. */
static bool read_head(source *s, const char *key, const char *value)
{
    kmp_tir_file *tir = s->tir;
    const int number = (int)strtol(value, NULL, 10);
    if (is_equal(key, "FITTYP"))
        s->fit = isdigit((unsigned char)*value) ? number : s->fit;
    if (is_equal(key, "PROPERTY_FILE_FORMAT") || (is_equal(key, "FITTYP") && isalpha((unsigned char)*value)))
        strncpy(s->format, value, sizeof s->format - 1);
    else if (is_equal(key, "USE_MODE"))
        tir->mode = abs(number);
    else if (is_equal(key, "TYRESIDE"))
        tir->right = is_equal(value, "right");
    else if (!is_equal(key, "FITTYP"))
        return false;
    return true;
}

static void read_pair(source *s, const char *key, char *value)
{
    char *end;
    if (strcmp(s->section, "UNITS") == 0) {
        read_unit(s, key, value);
        return;
    }
    if (read_head(s, key, value))
        return;
    const double x = strtod(value, &end);
    for (int k = 0; k < KMP_TIR_COUNT; k++) {
        if (!is_equal(key, rows[k].key))
            continue;
        if (end == value || !isfinite(x))
            COMPLAIN(s, "%s is not a number: '%s'", key, value);
        else if (s->tir->given[k])
            COMPLAIN(s, "the file has two values of '%s'", key);
        s->tir->value[k] = x;
        s->tir->given[k] = true;
        return;
    }
    if (end == value || x == 0)
        return;
    s->inflated = is_equal(key, "INFLPRES") ? x : s->inflated;
    s->nominal = is_equal(key, "NOMPRES") ? x : s->nominal;
    s->pressed = s->pressed || (toupper((unsigned char)key[0]) == 'P' && toupper((unsigned char)key[1]) == 'P');
    /* A key without a place in the equations: words, dimensions and masses say nothing to them. */
    static const char *const silent[] = {
        "MDI_HEADER", "UNITS", "DIMENSION", "MODEL", "INERTIA", "TIRE_CONDITIONS", "OPERATING_CONDITIONS", "SHAPE"};
    for (size_t k = 0; k < sizeof silent / sizeof *silent; k++)
        if (strcmp(s->section, silent[k]) == 0)
            return;
    add_unused(s, "", key, "");
}

static char *trimmed(char *text)
{
    while (isspace((unsigned char)*text))
        text++;
    char *end = text + strlen(text);
    while (end > text && isspace((unsigned char)end[-1]))
        *--end = '\0';
    return text;
}

static void read_line(source *s, char *line)
{
    bool quoted = false;
    for (char *c = line; *c; c++) {
        quoted = quoted != (*c == '\'' || *c == '"');
        if (!quoted && (*c == '$' || *c == '!'))
            *c = '\0';
        if (!*c)
            break;
    }
    line = trimmed(line);
    char *equals = strchr(line, '=');
    if (*line == '[') {
        char *close = strchr(line, ']');
        if (!close) {
            COMPLAIN(s, "a section without ']': '%s'", line);
            return;
        }
        *close = '\0';
        strncpy(s->section, trimmed(line + 1), sizeof s->section - 1);
        s->skips = false;
    } else if (*line == '{') {
        s->skips = true;
        if (strcmp(s->section, "SHAPE") != 0)
            add_unused(s, "[", s->section, "]");
    } else if (*line && equals) {
        *equals = '\0';
        char *key = trimmed(line), *value = trimmed(equals + 1);
        const size_t length = strlen(value);
        if (length > 1 && (*value == '\'' || *value == '"') && value[length - 1] == *value) {
            value[length - 1] = '\0';
            value = trimmed(value + 1);
        }
        read_pair(s, key, value);
    } else if (*line && !s->skips && strcmp(s->section, "") != 0 && !isdigit((unsigned char)*line) && *line != '-' &&
               *line != '#') {
        COMPLAIN(s, "a line of the file is neither [SECTION] nor KEY = value: '%s'", line);
    }
}

/* The form of the equations, by number or name. */
static void find_form(source *s)
{
    static const struct {
        int fit;
        const char *name;
        kmp_tyre_form form;
    } forms[] = {{5, "PAC2002", KMP_TYRE_MF52}, {6, "MF_05", KMP_TYRE_MF52},       {21, "MF-TYRE", KMP_TYRE_MF52},
                 {51, "MF52", KMP_TYRE_MF52},   {52, "MF5.2", KMP_TYRE_MF52},      {61, "MF6.1", KMP_TYRE_MF61},
                 {61, "MF61", KMP_TYRE_MF61},   {52, "MF-TYRE 5.2", KMP_TYRE_MF52}};
    for (size_t k = 0; k < sizeof forms / sizeof *forms; k++)
        if (s->fit >= 0 ? s->fit == forms[k].fit : is_equal(s->format, forms[k].name)) {
            s->tir->form = forms[k].form;
            return;
        }
    s->place.line = 1;
    if (s->fit >= 0)
        COMPLAIN(s, "FITTYP = %d is %s, which is not read: PAC2002, MF 5.2 (5, 6, 21, 51, 52) and MF 6.1 (61) are",
                 s->fit, s->fit == 62 ? "MF 6.2" : "a form of the Magic Formula");
    else if (*s->format)
        COMPLAIN(s,
                 "PROPERTY_FILE_FORMAT = '%s' is not read: PAC2002, MF_05, MF-TYRE, MF 5.2 and MF 6.1 "
                 "are, or FITTYP says which form it is",
                 s->format);
    else
        COMPLAIN(s,
                 "the file has neither FITTYP nor PROPERTY_FILE_FORMAT, by which the form of its equations is known");
}

/* All missing keys in one message. */
static void check_complete(source *s)
{
    kmp_text missing = {0};
    int count = 0;
    for (int k = 0; k < KMP_TIR_COUNT; k++)
        if (rows[k].required && !s->tir->given[k])
            kmp_text_printf(&missing, count++ > 0 ? ", %s" : "%s", rows[k].key);
    s->place.line = 1;
    if (count > 0)
        COMPLAIN(s, "the file lacks %s", kmp_reader_take(s->r, &missing));
    kmp_text_free(&missing);
    if (s->good && s->pressed && s->inflated > 0 && s->nominal > 0 && s->inflated != s->nominal)
        COMPLAIN(s,
                 "INFLPRES = %g differs from NOMPRES = %g, and terms of the pressure (PP..) are not "
                 "read: give a file for this pressure",
                 s->inflated, s->nominal);
    static const int positive[] = {KMP_TIR_FNOMIN, KMP_TIR_UNLOADED_RADIUS, KMP_TIR_PCX1, KMP_TIR_PCY1};
    for (size_t k = 0; s->good && k < sizeof positive / sizeof *positive; k++)
        if (!(s->tir->value[positive[k]] > 0))
            COMPLAIN(s, "%s must be positive, not %g", rows[positive[k]].key, s->tir->value[positive[k]]);
}

bool kmp_tir_read(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_tir_file *tir)
{
    source s = {.r = r, .what = what, .tir = tir, .unit = {1, 1, 1, 1, 1}, .fit = -1, .good = true};
    size_t length;
    *tir = (kmp_tir_file){.mode = -1};
    if (!kmp_read_word(r, node, what))
        return false;
    const char *path = kmp_path_beside(r, node->place.file, node->text);
    s.place = (kmp_place){.line = 0, .column = 1, .file = kmp_reader_add_file(r, path)};
    char *text = s.place.file < 0 ? NULL : kmp_read_file(r, KMP_FILE_POINTS, node, what, path, &length);
    for (char *line = text; line && *line;) {
        char *end = line + strcspn(line, "\n");
        const bool more = *end == '\n';
        *end = '\0';
        s.place.line++;
        read_line(&s, line);
        line = end + more;
    }
    if (text && s.good)
        find_form(&s);
    if (text && s.good)
        check_complete(&s);
    for (int k = 0; k < KMP_TIR_COUNT; k++)
        tir->value[k] = tir->given[k] ? tir->value[k] * unit_of(&s, rows[k].dimension) : rows[k].absent;
    tir->unused_count = s.unused_count;
    tir->unused = s.unused_count > 0 ? kmp_reader_take(r, &s.unused) : NULL;
    kmp_text_free(&s.unused);
    const bool read = text;
    kmp_free(text);
    return s.good && read;
}
