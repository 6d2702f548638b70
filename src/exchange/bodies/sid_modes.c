/* SPDX-License-Identifier: BSD-3-Clause */
/* The text is a tree of objects between `NAME` and `end NAME`. Objects of numbers are expansions A(q) = A0 + sum A1_k
 * q_k with entries m0(row, column) and m1(row, mode, column); some programs write m1(row, column, mode). Integrals are
 * compared wherever the file has them twice. */
#include "exchange/bodies/sid_modes.h"
#include "exchange/bodies/fortran_text.h"
#include <math.h>
#include <string.h>

/* Differences between integrals that say the same, by their scale. Six digits are written by some programs; masses of
 * different kinds, lumped and consistent, give more than that, and other orders of indices much more. */
static const double ALIKE = 1e-5, UNLIKE = 0.1;

enum { NODES_MOST = 100000 };

/* -- objects ----------------------------------------------------------------------------------------- */

typedef enum part { MDCM, J, CT, CR, ME, GR, GE, OE, KSIGMA, KE, DE, PARTS } part;
typedef enum node_part { ORIGIN, PHI, PSI, AP, SIGMA, NODE_PARTS } node_part;

/* Of the body, then of a node; a second name is used by other programs. */
static const char *const names[PARTS + NODE_PARTS][2] = {
    {"mdCM", "mCM"}, {"J", "mmi"}, {"Ct", ""},  {"Cr", ""},     {"Me", ""},  {"Gr", ""},  {"Ge", ""}, {"Oe", ""},
    {"ksigma", ""},  {"Ke", "K"},  {"De", "D"}, {"origin", ""}, {"phi", ""}, {"psi", ""}, {"AP", ""}, {"sigma", ""},
};

typedef struct entry {
    int line, column, order, index[3];
    double value;
} entry;

/* An expansion: its sizes and entries as written, then its numbers. */
typedef struct expansion {
    int line, column; /* 0: it is absent */
    int order, rows, columns, modes, structure;
    int count;
    entry *entries;
    double *zero, *first; /* rows x columns; modes x rows x columns, NULL without entries */
} expansion;

typedef struct node {
    const char *name;
    int line, column;
    expansion part[NODE_PARTS];
} node;

typedef enum level { OUTSIDE, FILE_PART, MODAL, REFMOD, FRAME, NODE, OBJECT, DONE } level;

typedef struct reading {
    const kmp_modal_source *source;
    kmp_text_line line;
    level level, around; /* around: of an object */
    int object;          /* of `names` */
    double mass;
    int mode_count;
    expansion part[PARTS];
    int node_count;
    node *nodes;
    bool mode_last; /* m1(row, column, mode) */
    double gap;     /* the largest difference between integrals that say the same, by their scale */
    const char *gap_words;
} reading;

#define REFUSE(s, ...) kmp_modal_refuse_at((s)->source, (s)->line.number, (s)->line.column, __VA_ARGS__)

static expansion *place_of(reading *s, int k)
{
    return k < PARTS ? &s->part[k] : &s->nodes[s->node_count - 1].part[k - PARTS];
}

/* -- lines ------------------------------------------------------------------------------------------- */

/* The words of a line before `=`, with single blanks between them, and the text behind it. */
static void split(const reading *s, char key[32], const char **value, size_t *length)
{
    const kmp_text_line *line = &s->line;
    const char *sign = memchr(line->s, '=', line->length);
    const size_t before = sign ? (size_t)(sign - line->s) : line->length;
    size_t count = 0;
    for (size_t k = 0; k < before && count < 31; k++)
        if (line->s[k] != ' ' && line->s[k] != '\t')
            key[count++] = line->s[k];
        else if (count > 0 && key[count - 1] != ' ')
            key[count++] = ' ';
    while (count > 0 && key[count - 1] == ' ')
        count--;
    key[count] = '\0';
    *value = sign ? sign + 1 : line->s + line->length;
    *length = line->length - (size_t)(*value - line->s);
}

/* m0( 1, 2) or m1( 1, 2, 3), a key without its blanks. */
static bool read_entry(reading *s, const char *key, const char *value, size_t length)
{
    expansion *x = place_of(s, s->object);
    entry own = {.line = s->line.number, .column = s->line.column, .order = key[1] - '0'};
    const int count = own.order + 2;
    const char *at = strchr(key, '(');
    for (int k = 0; k < count && at; k++) {
        const size_t digits = strcspn(++at, k < count - 1 ? "," : ")");
        if (!at[digits] || !kmp_fortran_whole(at, digits, &own.index[k]) || own.index[k] < 1)
            at = NULL;
        else
            at += digits;
    }
    if (!at || at[1])
        return REFUSE(s, "'%s' of '%s': entries are m0(row, column) and m1(row, mode, column), counted from 1", key,
                      names[s->object][0]);
    if (!kmp_fortran_number(value, length, &own.value) || fabs(own.value) > KMP_MODAL_LARGEST)
        return REFUSE(s, "'%s' of '%s' is '%.*s': a number up to %g is expected", key, names[s->object][0],
                      (int)(length < 40 ? length : 40), value, KMP_MODAL_LARGEST);
    entry *entries = kmp_arena_room(s->source->arena, x->entries, x->count, sizeof *entries);
    if (!entries)
        return false;
    x->entries = entries;
    entries[x->count++] = own;
    return true;
}

static bool read_size(reading *s, const char *key, const char *value, size_t length)
{
    static const char *const words[] = {"order", "nrow", "ncol", "nq", "nqn", "structure"};
    static const int most[] = {9, 3 * KMP_MODAL_MODES_MOST, 3 * KMP_MODAL_MODES_MOST, KMP_MODAL_MODES_MOST, 9999, 4};
    expansion *x = place_of(s, s->object);
    int unused, *const to[] = {&x->order, &x->rows, &x->columns, &x->modes, &unused, &x->structure};
    for (int k = 0; k < 6; k++) {
        if (strcmp(key, words[k]) != 0)
            continue;
        if (!kmp_fortran_whole(value, length, to[k]) || *to[k] < 0 || *to[k] > most[k])
            return REFUSE(s, "'%s' of '%s' is '%.*s': a whole number from 0 to %d is expected", key,
                          names[s->object][0], (int)(length < 40 ? length : 40), value, most[k]);
        return true;
    }
    return REFUSE(s,
                  "'%s' is not a line of '%s', which has order, nrow, ncol, nq, nqn, structure, m0(row, column) and "
                  "m1(row, mode, column)",
                  key, names[s->object][0]);
}

static bool read_refmod(reading *s, const char *key, const char *value, size_t length)
{
    if (strcmp(key, "mass") == 0)
        return (kmp_fortran_number(value, length, &s->mass) && s->mass > 0) ||
               REFUSE(s, "the mass is '%.*s': a positive number is expected", (int)(length < 40 ? length : 40), value);
    if (strcmp(key, "nelastq") == 0)
        return (kmp_fortran_whole(value, length, &s->mode_count) && s->mode_count >= 1 &&
                s->mode_count <= KMP_MODAL_MODES_MOST) ||
               REFUSE(s, "nelastq, the number of modes, is '%.*s': 1 to %d are read; write the slowest ones",
                      (int)(length < 40 ? length : 40), value, KMP_MODAL_MODES_MOST);
    return strncmp(key, "ielastq", 7) == 0 ||
           REFUSE(s, "'%s' is not a line of 'refmod', which has mass, nelastq and ielastq", key);
}

static bool begin_node(reading *s, const char *value, size_t length)
{
    kmp_text_line own = {.s = value, .length = length};
    kmp_text_line_trim(&own);
    if (own.length == 0 || own.length > 60)
        return REFUSE(s, "a node has no name: 'new node = 12' is expected");
    if (s->node_count == NODES_MOST)
        return REFUSE(s, "more than %d nodes: write those that joints, forces and outputs use", NODES_MOST);
    node *nodes = kmp_arena_room(s->source->arena, s->nodes, s->node_count, sizeof *nodes);
    const char *name = kmp_arena_printf(s->source->arena, "%.*s", (int)own.length, own.s);
    if (!nodes || !name)
        return false;
    s->nodes = nodes;
    nodes[s->node_count++] = (node){.name = name, .line = s->line.number, .column = s->line.column};
    s->level = NODE;
    return true;
}

static bool begin_object(reading *s, const char *key)
{
    const int first = s->level == NODE ? PARTS : 0, end = s->level == NODE ? PARTS + NODE_PARTS : PARTS;
    for (int k = first; k < end; k++) {
        if (strcmp(key, names[k][0]) != 0 && (!names[k][1][0] || strcmp(key, names[k][1]) != 0))
            continue;
        expansion *x = place_of(s, k);
        if (x->line > 0)
            return REFUSE(s, "'%s' is there twice: the first one is in line %d", key, x->line);
        *x = (expansion){.line = s->line.number, .column = s->line.column, .structure = 3};
        s->object = k;
        s->around = s->level;
        s->level = OBJECT;
        return true;
    }
    return REFUSE(s, "'%s' is not an object of standard input data: %s", key,
                  s->level == NODE ? "a node has origin, phi, psi, AP and sigma"
                                   : "a body has refmod, frame, mdCM, J, Ct, Cr, Me, Gr, Ge, Oe, ksigma, Ke and De");
}

/* One line in its level. */
static bool read_line(reading *s)
{
    static const struct {
        level in;
        const char *word;
        level to;
    } steps[] = {{FILE_PART, "new modal", MODAL}, {MODAL, "refmod", REFMOD},       {MODAL, "new frame", FRAME},
                 {MODAL, "frame", FRAME},         {REFMOD, "end refmod", MODAL},   {NODE, "end node", FRAME},
                 {FRAME, "end frame", MODAL},     {MODAL, "end modal", FILE_PART}, {FILE_PART, "end part", DONE}};
    const char *value;
    char key[32], plain[32];
    size_t length, count = 0;
    split(s, key, &value, &length);
    for (size_t k = 0; k < sizeof steps / sizeof *steps; k++)
        if (s->level == steps[k].in && strcmp(key, steps[k].word) == 0) {
            s->level = steps[k].to;
            return true;
        }
    for (const char *c = key; *c; c++)
        if (*c != ' ')
            plain[count++] = *c;
    plain[count] = '\0';
    if (s->level == REFMOD)
        return read_refmod(s, key, value, length);
    if (s->level == FRAME && strcmp(key, "new node") == 0)
        return begin_node(s, value, length);
    if (s->level == NODE && strcmp(key, "rframe") == 0)
        return true;
    if (s->level == MODAL || s->level == NODE)
        return begin_object(s, key);
    if (s->level == OBJECT && strncmp(key, "end ", 4) == 0) {
        const bool own = strcmp(key + 4, names[s->object][0]) == 0 || strcmp(key + 4, names[s->object][1]) == 0;
        s->level = s->around;
        return own || REFUSE(s, "'%s' ends '%s', which began in line %d", key, names[s->object][0],
                             place_of(s, s->object)->line);
    }
    if (s->level == OBJECT && plain[0] == 'm' && (plain[1] == '0' || plain[1] == '1') && plain[2] == '(')
        return read_entry(s, plain, value, length);
    if (s->level == OBJECT)
        return read_size(s, key, value, length);
    return REFUSE(s, "'%s' is not expected here: %s", key,
                  s->level == FRAME ? "a frame has nodes, 'new node = 12'"
                                    : "a file has one body, from 'part' and 'new modal' to 'end modal' and 'end part'");
}

/* Comments are before `part`. */
static bool read_text(reading *s)
{
    s->line = (kmp_text_line){.rest = s->source->bytes};
    while (kmp_text_line_next(&s->line)) {
        const char *end = memchr(s->line.s, '$', s->line.length);
        s->line.length = end ? (size_t)(end - s->line.s) : s->line.length;
        kmp_text_line_trim(&s->line);
        if (s->level == OUTSIDE && s->line.length == 4 && memcmp(s->line.s, "part", 4) == 0)
            s->level = FILE_PART;
        else if (s->level != OUTSIDE && s->level != DONE && s->line.length > 0 && !read_line(s))
            return false;
    }
    if (s->level == OUTSIDE)
        return kmp_modal_refuse(s->source, "it has no line 'part', which begins a body of standard input data");
    return s->level == DONE || REFUSE(s, "it ends before 'end part': it is not complete");
}

/* -- numbers of expansions --------------------------------------------------------------------------- */

/* The order of indices that the entries of an expansion may have. */
static void narrow(const expansion *x, bool *mode_second, bool *mode_third)
{
    for (int k = 0; k < x->count; k++) {
        const int *index = x->entries[k].index;
        *mode_second = *mode_second && (x->entries[k].order == 0 || (index[1] <= x->modes && index[2] <= x->columns));
        *mode_third = *mode_third && (x->entries[k].order == 0 || (index[2] <= x->modes && index[1] <= x->columns));
    }
}

static bool put_entry(const reading *s, const char *name, expansion *x, const entry *own, bool *seen)
{
    const bool first = own->order == 1;
    const int i = own->index[0], mode = first ? own->index[s->mode_last ? 2 : 1] : 1,
              j = own->index[!first || s->mode_last ? 1 : 2];
    if (i > x->rows || j > x->columns || (first && mode > x->modes))
        return kmp_modal_refuse_at(
            s->source, own->line, own->column,
            "entry m%d of '%s' is in row %d, column %d%s: it has %d rows, %d columns and %d modes", own->order, name, i,
            j, first ? kmp_arena_printf(s->source->arena, ", mode %d", mode) : "", x->rows, x->columns, x->modes);
    const ptrdiff_t at = ((ptrdiff_t)(mode - 1) * x->rows + i - 1) * x->columns + j - 1,
                    mirror = ((ptrdiff_t)(mode - 1) * x->rows + j - 1) * x->columns + i - 1,
                    flag = at + (first ? (ptrdiff_t)x->rows * x->columns : 0);
    if (seen[flag])
        return kmp_modal_refuse_at(s->source, own->line, own->column,
                                   "entry m%d of row %d, column %d of '%s' is there twice", own->order, i, j, name);
    seen[flag] = true;
    if (own->value != 0 && (x->structure == 0 || x->structure == 4 || (x->structure == 1 && i != j)) && !first)
        return kmp_modal_refuse_at(s->source, own->line, own->column,
                                   "entry m0 of row %d, column %d of '%s' is %.6g, and its structure %d says %s", i, j,
                                   name, own->value, x->structure,
                                   x->structure == 0   ? "that all are zero"
                                   : x->structure == 1 ? "that only the diagonal is not zero"
                                                       : "that it is the unit matrix");
    double *to = first ? x->first : x->zero;
    to[at] = own->value;
    if (x->structure == 2 && i <= x->columns && j <= x->rows && !seen[mirror + flag - at])
        to[mirror] = own->value;
    return true;
}

/* The numbers of an expansion of known sizes; one that is absent is zero. */
static bool fill(const reading *s, const char *name, expansion *x, int rows, int columns, bool required)
{
    bool *seen, any = false;
    if (x->line == 0 && required)
        return kmp_modal_refuse(s->source, "it has no object '%s'", name);
    if (x->line > 0 && (x->rows != rows || x->columns != columns))
        return kmp_modal_refuse_at(s->source, x->line, x->column, "'%s' is %d x %d: %d x %d is expected of %d modes",
                                   name, x->rows, x->columns, rows, columns, s->mode_count);
    if (x->order > 1)
        return kmp_modal_refuse_at(s->source, x->line, x->column, "'%s' is of order %d: orders 0 and 1 are read", name,
                                   x->order);
    for (int k = 0; k < x->count; k++) {
        any = any || x->entries[k].order == 1;
        if (x->entries[k].order > x->order)
            return kmp_modal_refuse_at(s->source, x->entries[k].line, x->entries[k].column,
                                       "'%s' is of order 0, and has an entry m1", name);
    }
    if (any && x->modes != s->mode_count)
        return kmp_modal_refuse_at(s->source, x->line, x->column, "'%s' is expanded in %d modes: the body has %d", name,
                                   x->modes, s->mode_count);
    const ptrdiff_t size = (ptrdiff_t)rows * columns, all = size * (any ? 1 + s->mode_count : 1);
    if (!KMP_ARENA_MAKE(s->source->arena, KMP_ROOM(double, size, &x->zero), KMP_ROOM(bool, all, &seen)) ||
        (any && !KMP_ARENA_EACH(s->source->arena, double, all - size, &x->first)))
        return false;
    for (int k = 0; k < rows && x->structure == 4; k++)
        x->zero[k * columns + (k < columns ? k : 0)] = 1;
    for (int k = 0; k < x->count; k++)
        if (!put_entry(s, name, x, &x->entries[k], seen))
            return false;
    return true;
}

static void drop_first(expansion *x)
{
    int kept = 0;
    for (int k = 0; k < x->count; k++)
        if (x->entries[k].order == 0)
            x->entries[kept++] = x->entries[k];
    x->count = kept;
}

static bool fill_body(reading *s)
{
    const int n = s->mode_count;
    const expansion *j = &s->part[J];
    const bool tensor = j->rows == 3; /* otherwise xx, yy, zz, xy, xz, yz */
    const struct {
        part part;
        int rows, columns;
        bool required;
    } all[] = {{MDCM, 3, 1, true},    {J, tensor ? 3 : 6, tensor ? 3 : 1, true},
               {CT, n, 3, true},      {CR, n, 3, true},
               {ME, n, n, true},      {GR, 3, 3 * n, false},
               {GE, n, 3 * n, false}, {OE, n, 6, false},
               {KSIGMA, n, 1, false}, {KE, n, n, true},
               {DE, n, n, false}};
    bool good = true;
    for (size_t k = 0; k < sizeof all / sizeof *all && good; k++) {
        expansion *x = &s->part[all[k].part];
        if (all[k].part == GR || all[k].part == GE) /* their first order is of third order in the energy */
            drop_first(x);
        good = fill(s, names[all[k].part][0], x, all[k].rows, all[k].columns, all[k].required);
    }
    return good;
}

/* -- integrals --------------------------------------------------------------------------------------- */

static double trace(const double t[9])
{
    return t[0] + t[4] + t[8];
}

/* The symmetric matrix of the coefficients of wx^2, wy^2, wz^2, wx wy, wy wz, wz wx in w'Zw - w'w tr Z. */
static void matrix_of_spin(const double o[6], double z[9])
{
    for (int i = 0; i < 3; i++)
        z[4 * i] = o[i] - (o[0] + o[1] + o[2]) / 2;
    z[1] = z[3] = o[3] / 2;
    z[5] = z[7] = o[4] / 2;
    z[2] = z[6] = o[5] / 2;
}

/* The tensor tr(P) 1 - P of six numbers or of nine; P of it. */
static void second_of(const reading *s, const double *j, double p[9])
{
    static const int six[9] = {0, 3, 4, 3, 1, 5, 4, 5, 2};
    double tensor[9];
    for (int i = 0; i < 9; i++)
        tensor[i] = s->part[J].rows == 3 ? (j[i] + j[i % 3 * 3 + i / 3]) / 2 : j[six[i]];
    for (int i = 0; i < 9; i++)
        p[i] = (i % 4 == 0 ? trace(tensor) / 2 : 0) - tensor[i];
}

/* Adds the matrix with the axial vector v and no symmetric part. */
static void add_axial(const double v[3], double z[9])
{
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        z[3 * k + j] += v[i] / 2;
        z[3 * j + k] -= v[i] / 2;
    }
}

/* Keeps the largest difference, and the words that name the pair. */
static void compare(reading *s, const char *words, int mode, double difference, double scale)
{
    const double off = scale > 0 ? difference / scale : difference > 0 ? INFINITY : 0;
    if (off > s->gap) {
        s->gap = off;
        s->gap_words = kmp_arena_printf(s->source->arena, "%s (mode %d)", words, mode + 1);
    }
}

static double apart(int count, const double *a, const double *b)
{
    double most = 0;
    for (int k = 0; k < count; k++)
        most = fmax(most, fabs(a[k] - b[k]));
    return most;
}

static double mode_mass(const reading *s, int k)
{
    return fmax(s->part[ME].zero[(s->mode_count + 1) * k], 0);
}

/* int phi_k X' dm: its symmetric part by Oe, or else by J; its axial vector by Cr. */
static void take_by_place(reading *s, kmp_modal_body *b)
{
    const expansion *oe = &s->part[OE], *j = &s->part[J], *gr = &s->part[GR];
    const int n = b->count;
    for (int k = 0; k < n; k++) {
        double *z = b->by_place + 9 * (ptrdiff_t)k, by_inertia[9] = {0}, twice[9], block[2][9];
        const double scale = sqrt(mode_mass(s, k) * fmax(trace(b->second), 0));
        if (j->first) { /* P + P' of first order */
            second_of(s, j->first + (ptrdiff_t)j->rows * j->columns * k, by_inertia);
            for (int i = 0; i < 9; i++)
                by_inertia[i] /= 2;
        }
        if (oe->line > 0)
            matrix_of_spin(oe->zero + 6 * (ptrdiff_t)k, z);
        else
            memcpy(z, by_inertia, sizeof by_inertia);
        if (j->first)
            compare(s, "Oe and J", k, apart(9, z, by_inertia), scale);
        add_axial(s->part[CR].zero + 3 * (ptrdiff_t)k, z);
        for (int i = 0; i < 9; i++) { /* Gr has a block for each mode, or for each axis of the rate */
            twice[i] = 2 * ((i % 4 == 0 ? trace(z) : 0) - z[i]);
            block[0][i] = gr->zero[(ptrdiff_t)(i / 3) * 3 * n + 3 * k + i % 3];
            block[1][i] = gr->zero[(ptrdiff_t)(i / 3) * 3 * n + i % 3 * n + k];
        }
        if (gr->line > 0)
            compare(s, "Gr and Cr with Oe", k, fmin(apart(9, twice, block[0]), apart(9, twice, block[1])) / 2, scale);
    }
}

/* The axial vectors of int phi_k phi_l' dm, n x n x 3, by Cr, or else by Ge: the part that changes its sign with k and
 * l; the other part is of second order. */
static bool take_axial(reading *s, double **vectors, double **more)
{
    const expansion *cr = &s->part[CR], *ge = &s->part[GE];
    const int n = s->mode_count;
    double worst[2] = {0};
    if (!KMP_ARENA_EACH(s->source->arena, double, 3 * n * n, vectors, more))
        return false;
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++)
            for (int i = 0; i < 3; i++) { /* Ge by axes, or by modes: the order in which it changes its sign */
                worst[0] = fmax(worst[0], fabs(ge->zero[(3 * k + i) * n + l] + ge->zero[(3 * l + i) * n + k]));
                worst[1] = fmax(worst[1], fabs(ge->zero[(k * n + l) * 3 + i] + ge->zero[(l * n + k) * 3 + i]));
            }
    const bool by_axes = worst[0] <= worst[1];
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++) {
            double *v = *vectors + 3 * (k * n + l), *w = *more + 3 * (k * n + l), twice[3];
            for (int i = 0; i < 3; i++) {
                const double a = cr->first ? cr->first[(l * n + k) * 3 + i] : 0,
                             c = cr->first ? cr->first[(k * n + l) * 3 + i] : 0;
                twice[i] = (by_axes ? ge->zero[(3 * k + i) * n + l] : ge->zero[(k * n + l) * 3 + i]) / 2;
                v[i] = cr->first ? (a - c) / 2 : twice[i];
                w[i] = (a + c) / 2;
            }
            if (ge->line > 0)
                compare(s, "Ge and Cr", k, apart(3, v, twice), sqrt(mode_mass(s, k) * mode_mass(s, l)));
        }
    return true;
}

static bool is_zero(const double *value, ptrdiff_t count)
{
    for (ptrdiff_t k = 0; k < count && value; k++)
        if (value[k] != 0)
            return false;
    return true;
}

/* Forces change with the coordinates where Ct or a displacement is of first order. */
static bool has_second_order(const reading *s)
{
    bool has = !is_zero(s->part[CT].first, 3 * (ptrdiff_t)s->mode_count * s->mode_count);
    for (int k = 0; k < s->node_count; k++)
        has = has || !is_zero(s->nodes[k].part[PHI].first, 3 * (ptrdiff_t)s->mode_count * s->mode_count);
    return has;
}

/* int phi_k phi_l' dm by its trace Me, its axial vector, and what Oe of first order says of the symmetric part. With
 * terms of second order Oe has those as well: motions depend only on the sum, and where its trace is not Me the
 * difference is theirs. */
static bool take_by_field(reading *s, kmp_modal_body *b)
{
    const expansion *oe = &s->part[OE];
    const int n = b->count;
    const bool second = has_second_order(s);
    double *axial, *more, worst = 0;
    int at = 0;
    if (second && !oe->first)
        return kmp_modal_refuse(s->source, "Ct or phi has terms of second order, and Oe has none: write all of them");
    if (!take_axial(s, &axial, &more) ||
        (second && !KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, 3 * n * n, &b->moment_more),
                                   KMP_ROOM(double, 9 * n * n, &b->second_more))))
        return false;
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++) {
            double *t = b->by_field + 9 * (ptrdiff_t)(k * n + l), spin[2][6] = {{0}}, y[9] = {0};
            const double mass = s->part[ME].zero[k * n + l], scale = sqrt(mode_mass(s, k) * mode_mass(s, l));
            for (int i = 0; i < 6 && oe->first; i++) {
                spin[0][i] = oe->first[(l * n + k) * 6 + i];
                spin[1][i] = oe->first[(k * n + l) * 6 + i];
            }
            double off = apart(6, spin[0], spin[1]) / 2;
            for (int i = 0; i < 6; i++)
                spin[0][i] = (spin[0][i] + spin[1][i]) / 2;
            matrix_of_spin(spin[0], t);
            const double rest = (mass - trace(t)) / 3;
            off = second ? off : fmax(off, fabs(3 * rest));
            if (scale > 0 && off / scale > worst) {
                worst = off / scale;
                at = k;
            }
            for (int i = 0; i < 9; i += 4) {
                t[i] += rest;
                y[i] -= rest;
            }
            add_axial(axial + 3 * (k * n + l), t);
            add_axial(more + 3 * (k * n + l), y);
            if (!second)
                compare(s, "Cr and its transpose", k, apart(3, more + 3 * (k * n + l), (double[3]){0}), scale);
            for (int i = 0; i < 9 && second; i++)
                b->second_more[((ptrdiff_t)i * n + k) * n + l] = y[i];
            for (int i = 0; i < 3 && second; i++)
                b->moment_more[((ptrdiff_t)i * n + k) * n + l] =
                    s->part[CT].first
                        ? (s->part[CT].first[(l * n + k) * 3 + i] + s->part[CT].first[(k * n + l) * 3 + i]) / 2
                        : 0;
        }
    s->source->to->first = s->source->to->whole = second;
    if (second && worst > UNLIKE)
        return kmp_modal_refuse(s->source,
                                "Oe of first order is not symmetric in its modes: it differs by %.2g of Me (mode %d)",
                                worst, at + 1);
    if (!second && (!oe->first || worst > UNLIKE)) {
        b->known = KMP_MODAL_TRACES;
        s->source->to->doubt =
            !oe->first ? "its file has no centrifugal terms of the deformed body (Oe of first order)"
                       : kmp_arena_printf(b->arena,
                                          "its centrifugal terms of the deformed body (Oe of first order) differ from "
                                          "its mass Me by %.2g of it (mode %d), and are not used",
                                          worst, at + 1);
    } else
        compare(s, "Oe and Me", at, worst, 1);
    return true;
}

/* Ke, Me, De: symmetric. */
static bool take_matrix(reading *s, part k, double **to)
{
    const int n = s->mode_count;
    double *m = s->part[k].zero;
    *to = m;
    if (!m)
        return false;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < i; j++) {
            const double scale = sqrt(fabs(m[i * n + i] * m[j * n + j])), a = m[i * n + j], c = m[j * n + i];
            if (fabs(a - c) > ALIKE * (scale > 0 ? scale : fabs(a) + fabs(c)))
                return kmp_modal_refuse_at(s->source, s->part[k].line, s->part[k].column,
                                           "'%s' is not symmetric: entry (%d, %d) is %.6g, (%d, %d) is %.6g; a matrix "
                                           "with one triangle has structure 2",
                                           names[k][0], i + 1, j + 1, a, j + 1, i + 1, c);
            m[i * n + j] = m[j * n + i] = (a + c) / 2;
        }
    return true;
}

static bool take_integrals(reading *s, kmp_modal_body *b)
{
    const int n = s->mode_count;
    const expansion *md = &s->part[MDCM], *ct = &s->part[CT];
    double *mass = NULL;
    b->count = n;
    b->mass = s->mass;
    if (!(s->mass > 0))
        return kmp_modal_refuse(s->source, "'refmod' has no mass");
    if (!take_matrix(s, KE, &b->stiffness) || !take_matrix(s, ME, &mass) || !take_matrix(s, DE, &b->damping) ||
        !KMP_ARENA_MAKE(b->arena, KMP_ROOM(double, 9 * n, &b->by_place), KMP_ROOM(double, 9 * n * n, &b->by_field)))
        return false;
    b->damping = is_zero(b->damping, (ptrdiff_t)n * n) ? NULL : b->damping;
    for (int k = 0; k < n; k++)
        if (!(mass[(n + 1) * k] > 0))
            return kmp_modal_refuse_at(s->source, s->part[ME].line, s->part[ME].column,
                                       "'Me': the mass of mode %d is %.6g: it must be "
                                       "positive",
                                       k + 1, mass[(n + 1) * k]);
    if (!is_zero(s->part[KSIGMA].zero, n) || !is_zero(s->part[KSIGMA].first, (ptrdiff_t)n * n))
        return kmp_modal_refuse_at(s->source, s->part[KSIGMA].line, s->part[KSIGMA].column,
                                   "'ksigma' is not zero: bodies with stresses before deformation are not read");
    memcpy(b->moment, md->zero, sizeof b->moment);
    second_of(s, s->part[J].zero, b->second);
    b->field = ct->zero;
    for (int k = 0; k < n && md->first; k++)
        compare(s, "mdCM and Ct", k, apart(3, md->first + 3 * (ptrdiff_t)k, ct->zero + 3 * (ptrdiff_t)k),
                sqrt(s->mass * mode_mass(s, k)));
    take_by_place(s, b);
    if (!take_by_field(s, b))
        return false;
    if (s->gap > UNLIKE)
        return kmp_modal_refuse(s->source,
                                "%s differ by %.2g of their scale: they are not integrals over one mass, or in another "
                                "order; Gr, Ge, and m1 of mdCM and J may be left out",
                                s->gap_words ? s->gap_words : "", s->gap);
    if (s->gap > ALIKE && !s->source->to->doubt)
        s->source->to->doubt = kmp_arena_printf(b->arena,
                                                "its %s differ by %.2g of their scale: they are not integrals "
                                                "over one mass",
                                                s->gap_words ? s->gap_words : "", s->gap);
    return true;
}

/* -- nodes ------------------------------------------------------------------------------------------- */

/* The axes of a node turn by psi, in the axes of the body: A1 = psi~ A0, which some programs write without A0. */
static bool check_axes(const reading *s, const node *own)
{
    const expansion *a = &own->part[AP], *psi = &own->part[PSI];
    const int n = s->mode_count;
    double off[2] = {0}, most = 0;
    for (int k = 0; k < n && a->first; k++) {
        double turn[9] = {0}, turned[9] = {0};
        add_axial((double[3]){2 * psi->zero[k], 2 * psi->zero[n + k], 2 * psi->zero[2 * n + k]}, turn);
        for (int i = 0; i < 9; i++)
            for (int e = 0; e < 3; e++)
                turned[i] += turn[i / 3 * 3 + e] * a->zero[3 * e + i % 3];
        off[0] = fmax(off[0], apart(9, turned, a->first + 9 * (ptrdiff_t)k));
        off[1] = fmax(off[1], apart(9, turn, a->first + 9 * (ptrdiff_t)k));
        for (int i = 0; i < 9; i++)
            most = fmax(most, fabs(turn[i]));
    }
    return fmin(off[0], off[1]) <= ALIKE * most ||
           kmp_modal_refuse_at(s->source, a->line, a->column,
                               "the axes of node '%s' turn otherwise than by psi, the rotation in axes of the body: AP "
                               "and psi differ by %.3g",
                               own->name, fmin(off[0], off[1]));
}

static bool check_place(const reading *s, const node *own)
{
    const int n = s->mode_count;
    const expansion *origin = &own->part[ORIGIN], *phi = &own->part[PHI];
    double most = 0, off = 0;
    for (int i = 0; i < 3 * n && origin->first; i++) {
        off = fmax(off, fabs(origin->first[i % n * 3 + i / n] - phi->zero[i]));
        most = fmax(most, fabs(phi->zero[i]));
    }
    if (off > ALIKE * most)
        return kmp_modal_refuse_at(s->source, origin->line, origin->column,
                                   "the place of node '%s' moves otherwise than by phi: origin and phi differ by %.3g",
                                   own->name, off);
    return is_zero(own->part[PSI].first, 3 * (ptrdiff_t)n * n) ||
           kmp_modal_refuse_at(s->source, own->part[PSI].line, own->part[PSI].column,
                               "psi of node '%s' is of first order: rotations of second order are not read", own->name);
}

/* Second derivatives of the displacement; zero where a node is held, NULL where the file has none. */
static bool take_more(const reading *s, const node *own, kmp_modal_place *place)
{
    const expansion *phi = &own->part[PHI];
    const int n = s->mode_count;
    const bool held = is_zero(phi->zero, 3 * (ptrdiff_t)n) && is_zero(own->part[PSI].zero, 3 * (ptrdiff_t)n);
    if (!s->source->to->first || (!phi->first && !held))
        return true;
    if (!KMP_ARENA_EACH(s->source->arena, double, 3 * n * n, &place->more))
        return false;
    for (int i = 0; i < 3 && phi->first; i++)
        for (int k = 0; k < n; k++)
            for (int l = 0; l < n; l++)
                place->more[((ptrdiff_t)i * n + k) * n + l] =
                    (phi->first[((ptrdiff_t)l * 3 + i) * n + k] + phi->first[((ptrdiff_t)k * 3 + i) * n + l]) / 2;
    return true;
}

static bool take_nodes(reading *s, kmp_modal_body *b)
{
    const int n = s->mode_count;
    if (!KMP_ARENA_MAKE(b->arena, KMP_ROOM(kmp_modal_place, s->node_count, &b->places),
                        KMP_ROOM(const char *, s->node_count, &s->source->to->names)))
        return false;
    for (int k = 0; k < s->node_count; k++) {
        node *own = &s->nodes[k];
        kmp_modal_place *place = &b->places[k];
        if (own->part[ORIGIN].line == 0 || own->part[PHI].line == 0 || own->part[PSI].line == 0)
            return kmp_modal_refuse_at(s->source, own->line, own->column, "node '%s' has no object '%s'", own->name,
                                       own->part[ORIGIN].line == 0 ? "origin"
                                       : own->part[PHI].line == 0  ? "phi"
                                                                   : "psi");
        if (!fill(s, "origin", &own->part[ORIGIN], 3, 1, true) || !fill(s, "phi", &own->part[PHI], 3, n, true) ||
            !fill(s, "psi", &own->part[PSI], 3, n, true) || !fill(s, "AP", &own->part[AP], 3, 3, false))
            return false;
        if (!check_axes(s, own) || !check_place(s, own))
            return false;
        s->source->to->names[k] = own->name;
        memcpy(place->at, own->part[ORIGIN].zero, sizeof place->at);
        place->shift = own->part[PHI].zero;
        place->turn = own->part[PSI].zero;
    }
    b->place_count = s->node_count;
    return true;
}

bool kmp_sid_modes_read(const kmp_modal_source *source)
{
    reading s = {.source = source};
    kmp_modal_body *b = &source->to->body;
    if (!kmp_modal_is_text(source) || !kmp_modal_scaled(source) || !read_text(&s))
        return false;
    if (s.mode_count == 0)
        return kmp_modal_refuse(source, "'refmod' has no 'nelastq', the number of modes");
    /* m1(row, mode, column) unless sizes say that it is m1(row, column, mode). */
    bool second = true, third = true;
    for (int k = 0; k < PARTS; k++)
        narrow(&s.part[k], &second, &third);
    for (int n = 0; n < s.node_count; n++)
        for (int k = 0; k < SIGMA; k++)
            narrow(&s.nodes[n].part[k], &second, &third);
    s.mode_last = !second && third;
    if (!fill_body(&s) || !take_nodes(&s, b) || !take_integrals(&s, b))
        return false;
    for (int k = 0; k < b->place_count; k++)
        if (!take_more(&s, &s.nodes[k], &b->places[k]))
            return false;
    kmp_modal_convert(b, (double[3]){source->units->length, source->units->mass, 1});
    return !source->arena->failed;
}
