/* SPDX-License-Identifier: BSD-3-Clause */
#include "model/flexible/npz_modes.h"
#include "model/files/npz.h"
#include <math.h>
#include <string.h>

/* Differences between arrays that say the same, by their scale: other programs write eight digits or more; a wrong
 * array differs by much more. */
static const double ALIKE = 1e-7;

enum { NODES_MOST = 1 << 22 };

typedef struct reading {
    const kmp_modal_source *source;
    kmp_npz npz;
} reading;

/* -- arrays ------------------------------------------------------------------------------------------ */

/* `any`: sizes of 0 are any. */
static void put_shape(kmp_text *text, int rank, const size_t *shape, bool any)
{
    if (rank == 0)
        kmp_text_put(text, "one number");
    for (int d = 0; d < rank; d++)
        if (any && shape[d] == 0)
            kmp_text_printf(text, "%sn", d > 0 ? " x " : "");
        else
            kmp_text_printf(text, "%s%zu", d > 0 ? " x " : "", shape[d]);
}

/* Shapes fit; sizes of 0 among the wanted ones are any. */
static bool fits(const kmp_npz_array *array, int rank, const size_t *shape)
{
    bool fit = array->rank == rank || (rank == 0 && array->count == 1);
    for (int d = 0; d < rank && fit; d++)
        fit = shape[d] == 0 || shape[d] == array->shape[d];
    return fit;
}

static bool read_array(const reading *f, const char *name, bool words, int rank, const size_t *shape,
                       kmp_npz_array *array)
{
    kmp_text own = {0};
    const bool there = kmp_npz_has(&f->npz, name), good = kmp_npz_array_read(&f->npz, name, array, &own);
    if (!there)
        kmp_modal_refuse(f->source,
                         "it has no array '%s': see the list of arrays of kempe-flexible-1 (docs/model/flexible.md)",
                         name);
    else if (!good)
        kmp_modal_refuse(f->source, "array '%s': %s", name, own.s ? own.s : "");
    else if (words != (array->word != NULL))
        kmp_modal_refuse(f->source, "array '%s' has %s where %s are expected", name, words ? "numbers" : "words",
                         words ? "words" : "numbers");
    else if (!fits(array, rank, shape)) {
        kmp_text is = {0}, wanted = {0};
        put_shape(&is, array->rank, array->shape, false);
        put_shape(&wanted, rank, shape, true);
        kmp_modal_refuse(f->source, "array '%s' is %s: %s is expected", name, is.s ? is.s : "",
                         wanted.s ? wanted.s : "");
        kmp_text_free(&is);
        kmp_text_free(&wanted);
    }
    kmp_text_free(&own);
    for (size_t k = 0; !words && array->value && k < array->count; k++)
        if (!(fabs(array->value[k]) <= KMP_MODAL_LARGEST)) {
            kmp_modal_refuse(f->source, "array '%s' has the entry %g, number %zu: all must be finite, at most %g", name,
                             array->value[k], k, KMP_MODAL_LARGEST);
            break;
        }
    return f->source->why->length == 0 && !f->source->arena->failed;
}

#define SHAPE(...)                                                                                                     \
    (const size_t[])                                                                                                   \
    {                                                                                                                  \
        __VA_ARGS__                                                                                                    \
    }

/* The entries of an array; NULL: it is refused. */
static double *numbers(const reading *f, const char *name, int rank, const size_t *shape)
{
    kmp_npz_array array;
    return read_array(f, name, false, rank, shape, &array) ? array.value : NULL;
}

static bool has(const reading *f, const char *name)
{
    return kmp_npz_has(&f->npz, name);
}

/* -- checks of one array ----------------------------------------------------------------------------- */

/* entry (k, l) of n x n and (l, k) are alike, by the diagonal. */
static bool check_symmetric(const reading *f, const char *name, int n, const double *matrix)
{
    for (int k = 0; k < n; k++)
        for (int l = 0; l < k; l++) {
            const double a = matrix[k * n + l], b = matrix[l * n + k];
            const double scale = sqrt(fabs(matrix[k * n + k] * matrix[l * n + l]));
            if (fabs(a - b) > ALIKE * (scale > 0 ? scale : fabs(a) + fabs(b)))
                return kmp_modal_refuse(
                    f->source,
                    "array '%s' is not symmetric: entry (%d, %d) is %.6g, (%d, %d) is %.6g; a file with one "
                    "triangle must be completed",
                    name, k, l, a, l, k, b);
        }
    return true;
}

/* T_lk is the transpose of T_kl. */
static bool check_transposes(const reading *f, int n, const double *t)
{
    for (int k = 0; k < n; k++)
        for (int l = 0; l <= k; l++)
            for (int i = 0; i < 9; i++) {
                const double *own = t + 9 * ((ptrdiff_t)k * n + l), *other = t + 9 * ((ptrdiff_t)l * n + k);
                const double *a = t + 9 * ((ptrdiff_t)k * n + k), *c = t + 9 * ((ptrdiff_t)l * n + l);
                const double scale = sqrt(fabs((a[0] + a[4] + a[8]) * (c[0] + c[4] + c[8])));
                if (fabs(own[i] - other[i % 3 * 3 + i / 3]) > ALIKE * scale)
                    return kmp_modal_refuse(
                        f->source,
                        "array 'T': T[%d, %d] is not the transpose of T[%d, %d] (entry (%d, %d): %.6g and "
                        "%.6g); T[k, l] is the integral of phi_k phi_l' dm",
                        k, l, l, k, i / 3, i % 3, own[i], other[i % 3 * 3 + i / 3]);
            }
    return true;
}

static bool check_mass(const reading *f, const kmp_modal_body *b)
{
    const int n = b->count;
    const double *m = numbers(f, "M", 2, SHAPE((size_t)n, (size_t)n));
    double *own = m ? kmp_arena_alloc(f->source->arena, (size_t)n * (size_t)n, sizeof *own) : NULL;
    if (!own)
        return false;
    kmp_modal_mass(b, own);
    for (int k = 0; k < n; k++)
        for (int l = 0; l < n; l++)
            if (fabs(own[k * n + l] - m[k * n + l]) > ALIKE * sqrt(fabs(own[k * n + k] * own[l * n + l])))
                return kmp_modal_refuse(
                    f->source,
                    "arrays 'M' and 'T' differ: M[%d, %d] is %.9g, the trace of T[%d, %d] is %.9g; both must be "
                    "of one mass matrix and of the same modes",
                    k, l, m[k * n + l], k, l, own[k * n + l]);
    return true;
}

/* -- a mass matrix between nodes --------------------------------------------------------------------- */

/* Integrals by a mass matrix of the nodes that is the same for x, y and z. */
static bool take_nodal_mass(const reading *f, kmp_modal_body *b)
{
    kmp_npz_array value;
    const double *row, *column;
    int *i, *j;
    if (!read_array(f, "mass_value", false, 1, SHAPE(0), &value) || !has(f, "nodes") || !b->mode ||
        !(row = numbers(f, "mass_row", 1, SHAPE(value.count))) ||
        !(column = numbers(f, "mass_col", 1, SHAPE(value.count))) ||
        !KMP_ARENA_MAKE(f->source->arena, KMP_ROOM(int, value.count, &i, &j)))
        return kmp_modal_refuse(
            f->source,
            "the mass matrix of the nodes, 'mass_row', 'mass_col' and 'mass_value', needs 'nodes' and 'modes'");
    for (size_t e = 0; e < value.count; e++) {
        if (!(row[e] >= 0 && row[e] < b->node_count && column[e] >= 0 && column[e] < b->node_count) ||
            row[e] != floor(row[e]) || column[e] != floor(column[e]))
            return kmp_modal_refuse(f->source,
                                    "array 'mass_row' or 'mass_col', entry %zu, is (%g, %g): nodes are 0 to %d", e,
                                    row[e], column[e], b->node_count - 1);
        i[e] = (int)row[e];
        j[e] = (int)column[e];
    }
    return kmp_modal_integrate(b, (ptrdiff_t)value.count, i, j, value.value);
}

static bool check_alike(const reading *f, const char *name, int count, const double *given, const double *other,
                        double scale)
{
    for (int k = 0; k < count; k++)
        if (fabs(given[k] - other[k]) > ALIKE * scale)
            return kmp_modal_refuse(
                f->source,
                "array '%s', entry %d, is %.9g, and %.9g by the mass matrix of the nodes: both must be of one mass",
                name, k, given[k], other[k]);
    return true;
}

/* Integrals that the file has, in addition to its mass matrix. */
static bool check_nodal_mass(const reading *f, const kmp_modal_body *b)
{
    kmp_modal_body other = *b;
    double largest = 0;
    if (!take_nodal_mass(f, &other))
        return false;
    const double size = other.second[0] + other.second[4] + other.second[8];
    for (int k = 0; k < b->count; k++) {
        const double *t = other.by_field + 9 * ((ptrdiff_t)k * b->count + k);
        largest = fmax(largest, t[0] + t[4] + t[8]);
    }
    return check_alike(f, "m", 1, &b->mass, &other.mass, other.mass) &&
           check_alike(f, "b0", 3, b->moment, other.moment, sqrt(other.mass * size)) &&
           check_alike(f, "P0", 9, b->second, other.second, size) &&
           check_alike(f, "S", 3 * b->count, b->field, other.field, sqrt(other.mass * largest)) &&
           check_alike(f, "Z0", 9 * b->count, b->by_place, other.by_place, sqrt(size * largest)) &&
           check_alike(f, "T", 9 * b->count * b->count, b->by_field, other.by_field, largest);
}

/* -- parts of the file ------------------------------------------------------------------------------- */

static bool take_nodes(const reading *f, kmp_modal_body *b)
{
    kmp_npz_array nodes;
    if (!has(f, "nodes") && !has(f, "modes"))
        return true;
    if (!read_array(f, "nodes", false, 2, SHAPE(0, 3), &nodes))
        return false;
    if (nodes.shape[0] > NODES_MOST)
        return kmp_modal_refuse(f->source,
                                "array 'nodes' has %zu nodes, at most %d are read: write only the nodes of its surface",
                                nodes.shape[0], NODES_MOST);
    b->node_count = (int)nodes.shape[0];
    b->node = nodes.value;
    b->mode = numbers(f, "modes", 3, SHAPE(nodes.shape[0], 3, (size_t)b->count));
    if (!b->mode || !has(f, "node_number"))
        return b->mode;
    if (!(b->number = numbers(f, "node_number", 1, SHAPE(nodes.shape[0]))))
        return false;
    for (int k = 1; k < b->node_count; k++)
        if (b->number[k] <= b->number[k - 1])
            return kmp_modal_refuse(f->source,
                                    "array 'node_number' does not ascend: node %d has number %g, the next one %g",
                                    k - 1, b->number[k - 1], b->number[k]);
    return true;
}

static bool take_integrals(const reading *f, kmp_modal_body *b)
{
    static const char *const names[] = {"m", "b0", "P0", "S", "Z0", "T"};
    const size_t n = (size_t)b->count;
    const bool nodal = has(f, "mass_value");
    int given = 0;
    for (int k = 0; k < 6; k++)
        given += has(f, names[k]);
    if (given == 0 && nodal)
        return take_nodal_mass(f, b);
    const double *m = numbers(f, "m", 0, NULL), *b0 = numbers(f, "b0", 1, SHAPE(3)),
                 *p0 = numbers(f, "P0", 2, SHAPE(3, 3));
    const double *s = numbers(f, "S", 2, SHAPE(3, n));
    b->field = kmp_arena_alloc(f->source->arena, 3 * n, sizeof *b->field);
    b->by_place = numbers(f, "Z0", 3, SHAPE(n, 3, 3));
    b->by_field = numbers(f, "T", 4, SHAPE(n, n, 3, 3));
    if (!m || !b0 || !p0 || !s || !b->field || !b->by_place || !b->by_field)
        return false;
    b->mass = *m;
    memcpy(b->moment, b0, sizeof b->moment);
    memcpy(b->second, p0, sizeof b->second);
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < 3; i++)
            b->field[3 * k + i] = s[i * n + k];
    return !nodal || check_nodal_mass(f, b);
}

/* Displacement and rotation of a place are columns of their arrays. */
static bool take_places(const reading *f, kmp_modal_body *b)
{
    kmp_npz_array names;
    const size_t n = (size_t)b->count;
    if (!has(f, "interface_names") && !has(f, "interface_place"))
        return true;
    if (!read_array(f, "interface_names", true, 1, SHAPE(0), &names))
        return false;
    const size_t p = names.count;
    if (p > KMP_MODAL_PLACES_MOST)
        return kmp_modal_refuse(f->source, "array 'interface_names' has %zu names, the most are %d", p,
                                KMP_MODAL_PLACES_MOST);
    double *at = numbers(f, "interface_place", 2, SHAPE(p, 3));
    double *shift = at ? numbers(f, "interface_displacement", 3, SHAPE(p, 3, n)) : NULL;
    double *turn = shift ? numbers(f, "interface_rotation", 3, SHAPE(p, 3, n)) : NULL;
    double *more = turn && has(f, "interface_H") ? numbers(f, "interface_H", 4, SHAPE(p, 3, n, n)) : NULL;
    f->source->to->names = names.word;
    for (size_t k = 0; k < p && turn; k++) {
        if (!KMP_ARENA_GROW(f->source->arena, b->places, b->place_count))
            return false;
        b->places[b->place_count] = (kmp_modal_place){
            .shift = shift + 3 * n * k, .turn = turn + 3 * n * k, .more = more ? more + 3 * n * n * k : NULL};
        memcpy(b->places[b->place_count++].at, at + 3 * k, 3 * sizeof *at);
    }
    return turn && f->source->why->length == 0;
}

/* The forms of second order, all three arrays or none. */
static bool take_forms(const reading *f, kmp_modal_body *b)
{
    const size_t n = (size_t)b->count;
    const bool h = has(f, "h"), y = has(f, "Y"), more = has(f, "interface_H");
    f->source->to->first = h && y && more;
    if (!h && !y)
        return true;
    if (!h || !y || !more)
        return kmp_modal_refuse(
            f->source, "it has some of the arrays 'h', 'Y' and 'interface_H', and not '%s': 'first' needs all three",
            !h   ? "h"
            : !y ? "Y"
                 : "interface_H");
    b->moment_more = numbers(f, "h", 3, SHAPE(3, n, n));
    b->second_more = numbers(f, "Y", 4, SHAPE(3, 3, n, n));
    for (int i = 0; i < 3 && b->moment_more; i++)
        if (!check_symmetric(f, "h", b->count, b->moment_more + (ptrdiff_t)i * b->count * b->count))
            return false;
    for (int i = 0; i < 9 && b->second_more; i++)
        if (!check_symmetric(f, "Y", b->count, b->second_more + (ptrdiff_t)i * b->count * b->count))
            return false;
    return b->moment_more && b->second_more;
}

static bool take_matrices(const reading *f, kmp_modal_body *b)
{
    kmp_npz_array k;
    if (!read_array(f, "K", false, 2, SHAPE(0, 0), &k))
        return false;
    if (k.shape[0] != k.shape[1] || k.shape[0] < 1)
        return kmp_modal_refuse(f->source, "array 'K' is %zu x %zu: a row and a column for each mode are expected",
                                k.shape[0], k.shape[1]);
    if (k.shape[0] > KMP_MODAL_MODES_MOST)
        return kmp_modal_refuse(f->source, "array 'K' has %zu modes, the most are %d: write the slowest ones",
                                k.shape[0], KMP_MODAL_MODES_MOST);
    b->count = (int)k.shape[0];
    b->stiffness = k.value;
    b->damping = has(f, "D") ? numbers(f, "D", 2, SHAPE(k.shape[0], k.shape[0])) : NULL;
    return check_symmetric(f, "K", b->count, b->stiffness) && f->source->why->length == 0 &&
           (!b->damping || check_symmetric(f, "D", b->count, b->damping));
}

static bool check_body(const reading *f, const kmp_modal_body *b)
{
    if (!(b->mass > 0))
        return kmp_modal_refuse(f->source, "array 'm', the mass, is %.6g: it must be positive", b->mass);
    for (int i = 0; i < 3; i++)
        if (b->second[4 * i] < -ALIKE * (b->second[0] + b->second[4] + b->second[8]))
            return kmp_modal_refuse(f->source, "array 'P0': entry (%d, %d), the integral of a square, is %.6g", i, i,
                                    b->second[4 * i]);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < i; j++)
            if (fabs(b->second[3 * i + j] - b->second[3 * j + i]) >
                ALIKE * (b->second[0] + b->second[4] + b->second[8]))
                return kmp_modal_refuse(f->source,
                                        "array 'P0' is not symmetric: entry (%d, %d) is %.6g, (%d, %d) is %.6g", i, j,
                                        b->second[3 * i + j], j, i, b->second[3 * j + i]);
    for (int k = 0; k < b->count; k++) {
        const double *t = b->by_field + 9 * (ptrdiff_t)(b->count + 1) * k;
        if (!(t[0] + t[4] + t[8] > 0))
            return kmp_modal_refuse(
                f->source, "array 'T': the mass of mode %d, the trace of T[%d, %d], is %.6g: it must be positive", k, k,
                k, t[0] + t[4] + t[8]);
    }
    return check_transposes(f, b->count, b->by_field) && (!has(f, "M") || check_mass(f, b));
}

/* -- units ------------------------------------------------------------------------------------------- */

static bool take_units(const reading *f, const char *words, double units[3])
{
    return kmp_modal_units_find(words, units) ||
           kmp_modal_refuse(
               f->source,
               "array 'units' is '%s': units of length, mass and time are expected, such as 'm kg s' or 'mm t s'",
               words);
}

static bool take_format(const reading *f)
{
    kmp_npz_array format;
    if (!has(f, "format") && has(f, "modeBasis") && has(f, "stiffnessMatrix"))
        return kmp_modal_refuse(f->source,
                                "it is a file of Exudyn, whose arrays are pickled programs: write it again by "
                                "'python -m kempe.convert FILE OTHER.npz'");
    if (!has(f, "format"))
        return kmp_modal_refuse(
            f->source, "it has no array 'format' with the word 'kempe-flexible-1': files of other programs are "
                       "written again with the arrays of that format (docs/model/flexible.md)");
    if (!read_array(f, "format", true, 0, NULL, &format))
        return false;
    return strcmp(format.word[0], "kempe-flexible-1") == 0 ||
           kmp_modal_refuse(f->source, "array 'format' is '%s': 'kempe-flexible-1' is read", format.word[0]);
}

bool kmp_npz_modes_read(const kmp_modal_source *source)
{
    reading f = {.source = source};
    kmp_npz_array words;
    double unit[3] = {source->units->length, source->units->mass, 1};
    if (!kmp_npz_open(source->arena, source->bytes, source->length, &f.npz, source->why) || !take_format(&f))
        return false;
    if (has(&f, "units") && source->units->length > 0)
        return kmp_modal_refuse(source, "it has its units in the array 'units': remove 'scale'");
    if (!has(&f, "units") && !(source->units->length > 0))
        return kmp_modal_refuse(source, "it has no array 'units', such as 'm kg s': give the units of its numbers by "
                                        "'scale: {length: 1, mass: 1}'");
    if (has(&f, "units") && (!read_array(&f, "units", true, 0, NULL, &words) || !take_units(&f, words.word[0], unit)))
        return false;
    kmp_modal_body *b = &source->to->body;
    if (!take_matrices(&f, b) || !take_nodes(&f, b) || !take_integrals(&f, b) || !take_places(&f, b) ||
        !take_forms(&f, b) || !check_body(&f, b))
        return false;
    kmp_modal_convert(b, unit);
    return !source->arena->failed;
}
