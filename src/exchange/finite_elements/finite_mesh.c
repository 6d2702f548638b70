/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/finite_elements/finite_mesh.h"
#include "base/file.h"
#include "linalg/sparse.h"
#include "model/flexible/modal_file.h"
#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

/* Entries that should be the same differ by less than this part of their diagonal: texts have eight digits or more. */
static const double ALIKE = 1e-7;

static const double LARGEST = 1e60, LEAST = 1e-60; /* so that products of four numbers and quotients are numbers */

/* Vectors of 3 n numbers are counted by an int. */
enum { NODES_MOST = 1 << 22 };

kempe_status kmp_mesh_refuse(const kmp_finite_mesh *mesh, const char *format, ...)
{
    kmp_text sentence = {0};
    KMP_TEXT_ARGUMENTS(&sentence, format);
    kempe_status status = sentence.failed
                              ? kmp_fail_memory(mesh->context)
                              : kmp_complain(mesh->context, mesh->path, 0, 0, "%s", sentence.s ? sentence.s : "");
    kmp_text_free(&sentence);
    return status;
}

long kmp_mesh_number(const kmp_finite_mesh *mesh, int node)
{
    return mesh->number ? mesh->number[node] : node;
}

int kmp_mesh_find(const kmp_finite_mesh *mesh, long number)
{
    if (!mesh->number)
        return number >= 0 && number < mesh->node_count ? (int)number : -1;
    int low = 0, high = mesh->node_count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (mesh->number[middle] < number)
            low = middle + 1;
        else
            high = middle;
    }
    return low < mesh->node_count && mesh->number[low] == number ? low : -1;
}

bool kmp_mesh_add(kmp_arena *arena, kmp_mesh_entries *e, int row, int col, double value)
{
    int *rows = kmp_arena_room(arena, e->row, e->count, sizeof *rows);
    int *cols = kmp_arena_room(arena, e->col, e->count, sizeof *cols);
    double *values = kmp_arena_room(arena, e->value, e->count, sizeof *values);
    if (!rows || !cols || !values)
        return false;
    e->row = rows;
    e->col = cols;
    e->value = values;
    rows[e->count] = row;
    cols[e->count] = col;
    values[e->count++] = value;
    return true;
}

/* -- rows of a matrix -------------------------------------------------------------------------------- */

static const char *const direction[3] = {"x", "y", "z"};

/* "x of node 12", in an arena. */
static const char *row_words(const kmp_finite_mesh *mesh, int width, int row)
{
    const char *words = width == 1 ? kmp_arena_printf(mesh->arena, "node %ld", kmp_mesh_number(mesh, row))
                                   : kmp_arena_printf(mesh->arena, "%s of node %ld", direction[row % 3],
                                                      kmp_mesh_number(mesh, row / 3));
    return words ? words : "";
}

/* The entries by rows, and by columns within them, entries at one place added up. */
static bool gather(const kmp_finite_mesh *mesh, const kmp_mesh_entries *from, int n, kmp_mesh_rows *to)
{
    kmp_arena room = {0};
    int both = from->count, *row, *col, *of, *by_col, *order, *start, *sorted_row;
    for (int e = 0; e < from->count && from->triangle; e++)
        both += from->row[e] != from->col[e];
    *to = (kmp_mesh_rows){.n = n};
    if (!KMP_ARENA_MAKE(mesh->arena, KMP_ROOM(int, both + 1, &to->col), KMP_ROOM(double, both + 1, &to->value),
                        KMP_ROOM(int, n + 1, &to->start)) ||
        !KMP_ARENA_MAKE(&room, KMP_ROOM(int, both + 1, &row, &col, &of, &by_col, &order, &sorted_row),
                        KMP_ROOM(int, n + 1, &start))) {
        kmp_arena_free(&room);
        return false;
    }
    for (int e = 0, k = 0; e < from->count; e++) {
        const bool mirrored = from->triangle && from->row[e] != from->col[e];
        for (int side = 0; side <= mirrored; side++, k++) {
            row[k] = side ? from->col[e] : from->row[e];
            col[k] = side ? from->row[e] : from->col[e];
            of[k] = e;
        }
    }
    kmp_sort_entries(n, both, col, start, by_col);
    for (int k = 0; k < both; k++)
        sorted_row[k] = row[by_col[k]];
    memset(start, 0, ((size_t)n + 1) * sizeof *start);
    kmp_sort_entries(n, both, sorted_row, start, order);
    int count = 0;
    for (int i = 0; i < n; i++) {
        to->start[i] = count;
        for (int k = start[i]; k < start[i + 1]; k++) {
            const int e = by_col[order[k]];
            if (count == to->start[i] || to->col[count - 1] != col[e])
                to->col[count++] = col[e];
            to->value[count - 1] += from->value[of[e]];
        }
    }
    to->start[n] = count;
    kmp_arena_free(&room);
    return true;
}

static double entry_at(const kmp_mesh_rows *rows, int i, int j)
{
    int low = rows->start[i], high = rows->start[i + 1];
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (rows->col[middle] < j)
            low = middle + 1;
        else
            high = middle;
    }
    return low < rows->start[i + 1] && rows->col[low] == j ? rows->value[low] : 0;
}

/* All entries are finite, and entries off the diagonal in pairs. */
static kempe_status check_rows(const kmp_finite_mesh *mesh, const char *name, int width, const kmp_mesh_rows *rows)
{
    for (int i = 0; i < rows->n; i++)
        for (int k = rows->start[i]; k < rows->start[i + 1]; k++) {
            const int j = rows->col[k];
            const double a = rows->value[k], b = entry_at(rows, j, i);
            if (!(fabs(a) <= LARGEST))
                return kmp_mesh_refuse(mesh, "the %s between %s and %s is %g: all entries must be finite, at most %g",
                                       name, row_words(mesh, width, i), row_words(mesh, width, j), a, LARGEST);
            const double scale = sqrt(fabs(entry_at(rows, i, i) * entry_at(rows, j, j)));
            if (fabs(a - b) > ALIKE * (scale > 0 ? scale : fabs(a) + fabs(b)))
                return kmp_mesh_refuse(mesh,
                                       "the %s is not symmetric: %.6g between %s and %s, %.6g between %s and %s; a "
                                       "matrix of one triangle must be completed",
                                       name, a, row_words(mesh, width, i), row_words(mesh, width, j), b,
                                       row_words(mesh, width, j), row_words(mesh, width, i));
        }
    return KEMPE_OK;
}

/* -- the mass ---------------------------------------------------------------------------------------- */

/* The mass of three rows a node becomes the mass between nodes, if it is the same for x, y and z. Nothing else says how
 * much mass is where: the integrals of products of displacements do not follow from another one. */
static kempe_status take_scalar_mass(const kmp_finite_mesh *mesh, const kmp_mesh_rows *wide, kmp_mesh_rows *mass)
{
    kmp_mesh_entries between = {0};
    for (int i = 0; i < wide->n; i++)
        for (int k = wide->start[i]; k < wide->start[i + 1]; k++) {
            const int j = wide->col[k], a = i % 3, c = j % 3;
            const double scale = sqrt(fabs(entry_at(wide, i, i) * entry_at(wide, j, j)));
            const double other = a == c ? entry_at(wide, i - a + (a + 1) % 3, j - c + (c + 1) % 3) : 0;
            if (fabs(wide->value[k] - other) > ALIKE * (scale > 0 ? scale : fabs(wide->value[k]) + fabs(other)))
                return a != c ? kmp_mesh_refuse(
                                    mesh,
                                    "the mass between %s and %s is %.6g: masses of solid elements have none between "
                                    "different directions; constraints between nodes and rotations are not reduced",
                                    row_words(mesh, 3, i), row_words(mesh, 3, j), wide->value[k])
                              : kmp_mesh_refuse(mesh,
                                                "the mass between nodes %ld and %ld is %.6g for %s and %.6g for %s: "
                                                "solid elements have the same for x, y and z",
                                                kmp_mesh_number(mesh, i / 3), kmp_mesh_number(mesh, j / 3),
                                                wide->value[k], direction[a], other, direction[(a + 1) % 3]);
            if (a == 0 && c == 0 && !kmp_mesh_add(mesh->arena, &between, i / 3, j / 3, wide->value[k]))
                return kmp_fail_memory(mesh->context);
        }
    return kmp_made(mesh->context, gather(mesh, &between, wide->n / 3, mass));
}

static kempe_status check_mass(const kmp_finite_mesh *mesh)
{
    const kmp_mesh_rows *m = &mesh->mass;
    for (int i = 0; i < m->n; i++) {
        const double own = entry_at(m, i, i);
        if (!(own >= LEAST))
            return kmp_mesh_refuse(mesh, "the mass of node %ld is %.6g: it must be positive", kmp_mesh_number(mesh, i),
                                   own);
        for (int k = m->start[i]; k < m->start[i + 1]; k++)
            if (fabs(m->value[k]) > (1 + ALIKE) * sqrt(own * entry_at(m, m->col[k], m->col[k])))
                return kmp_mesh_refuse(mesh,
                                       "the mass between nodes %ld and %ld, %.6g, is larger than their own, %.6g and "
                                       "%.6g: the mass matrix is not positive",
                                       kmp_mesh_number(mesh, i), kmp_mesh_number(mesh, m->col[k]), m->value[k], own,
                                       entry_at(m, m->col[k], m->col[k]));
    }
    return KEMPE_OK;
}

/* -- nodes ------------------------------------------------------------------------------------------- */

/* Rows of nodes that remain; rows of others are -1. */
static void renumber(kmp_mesh_entries *entries, int width, const int *kept)
{
    int count = 0;
    for (int e = 0; e < entries->count; e++) {
        const int i = kept[entries->row[e] / width], j = kept[entries->col[e] / width];
        if (i < 0 || j < 0)
            continue;
        entries->row[count] = width * i + entries->row[e] % width;
        entries->col[count] = width * j + entries->col[e] % width;
        entries->value[count++] = entries->value[e];
    }
    entries->count = count;
}

/* Leaves out nodes without stiffness and mass, as of other parts of the file. */
static kempe_status leave_out_unused(kmp_finite_mesh *mesh)
{
    const int n = mesh->node_count;
    int *kept, count = 0;
    long *number;
    if (!KMP_ARENA_MAKE(mesh->arena, KMP_ROOM(int, n, &kept), KMP_ROOM(long, n, &number)))
        return kmp_fail_memory(mesh->context);
    for (int e = 0; e < mesh->stiffness_read.count; e++)
        if (mesh->stiffness_read.value[e] != 0)
            kept[mesh->stiffness_read.row[e] / 3] = kept[mesh->stiffness_read.col[e] / 3] = 1;
    for (int e = 0; e < mesh->mass_read.count; e++)
        if (mesh->mass_read.value[e] != 0)
            kept[mesh->mass_read.row[e] / mesh->mass_width] = kept[mesh->mass_read.col[e] / mesh->mass_width] = 1;
    for (int i = 0; i < n; i++) {
        number[count] = kmp_mesh_number(mesh, i);
        memmove(mesh->node + 3 * (ptrdiff_t)count, mesh->node + 3 * (ptrdiff_t)i, 3 * sizeof *mesh->node);
        kept[i] = kept[i] ? count++ : -1;
    }
    mesh->unused = n - count;
    if (mesh->unused == 0)
        return KEMPE_OK;
    mesh->number = number;
    mesh->node_count = count;
    renumber(&mesh->stiffness_read, 3, kept);
    renumber(&mesh->mass_read, mesh->mass_width, kept);
    for (int s = 0; s < mesh->set_count; s++) {
        int *nodes = KMP_ARENA_NEW(mesh->arena, int, mesh->sets[s].count), left = 0;
        if (!nodes)
            return kmp_fail_memory(mesh->context);
        for (int k = 0; k < mesh->sets[s].count; k++)
            if (kept[mesh->sets[s].nodes[k]] >= 0)
                nodes[left++] = kept[mesh->sets[s].nodes[k]];
        mesh->sets[s] = (kmp_node_set){mesh->sets[s].name, left, nodes};
    }
    return KEMPE_OK;
}

static kempe_status check_stiffness(const kmp_finite_mesh *mesh)
{
    for (int i = 0; i < mesh->stiffness.n; i++) {
        const double own = entry_at(&mesh->stiffness, i, i);
        if (!(own >= LEAST))
            return kmp_mesh_refuse(mesh,
                                   "the stiffness of %s is %.6g: it must be positive; where a support or a constraint "
                                   "has removed it, write the matrices of the free body",
                                   row_words(mesh, 3, i), own);
    }
    return KEMPE_OK;
}

static kempe_status check_nodes(const kmp_finite_mesh *mesh)
{
    if (mesh->node_count > NODES_MOST)
        return kmp_mesh_refuse(mesh, "it has %d nodes, the most are %d", mesh->node_count, NODES_MOST);
    for (ptrdiff_t k = 0; k < 3 * (ptrdiff_t)mesh->node_count; k++)
        if (!(fabs(mesh->node[k]) <= LARGEST))
            return kmp_mesh_refuse(mesh, "%s of node %ld is %g: it must be finite, at most %g", direction[k % 3],
                                   kmp_mesh_number(mesh, (int)(k / 3)), mesh->node[k], LARGEST);
    return KEMPE_OK;
}

/* -- units ------------------------------------------------------------------------------------------- */

static kempe_status take_units(kmp_finite_mesh *mesh)
{
    const char *given = mesh->options->units;
    double unit[3];
    if (given && mesh->units)
        return kmp_fail(mesh->context, KEMPE_E_ARGUMENT, "%s has its units, '%s': leave out --units", mesh->path,
                        mesh->units);
    if (!given && !mesh->units)
        return kmp_fail(mesh->context, KEMPE_E_ARGUMENT,
                        "%s does not state its units: give the units of length, mass and time, --units 'm kg s' or "
                        "--units 'mm t s'",
                        mesh->path);
    if (!kmp_modal_units_find(given ? given : mesh->units, unit))
        return given ? kmp_fail(mesh->context, KEMPE_E_ARGUMENT,
                                "--units '%s': units of length, mass and time are expected, such as 'm kg s' or "
                                "'mm t s'",
                                given)
                     : kmp_mesh_refuse(mesh,
                                       "array 'units' is '%s': units of length, mass and time are expected, such as "
                                       "'m kg s' or 'mm t s'",
                                       mesh->units);
    mesh->length = unit[0];
    for (ptrdiff_t k = 0; k < 3 * (ptrdiff_t)mesh->node_count; k++)
        mesh->node[k] *= unit[0];
    for (int e = 0; e < mesh->mass.start[mesh->mass.n]; e++)
        mesh->mass.value[e] *= unit[1];
    for (int e = 0; e < mesh->stiffness.start[mesh->stiffness.n]; e++)
        mesh->stiffness.value[e] *= unit[1] / (unit[2] * unit[2]);
    return KEMPE_OK;
}

/* -- reading ----------------------------------------------------------------------------------------- */

static const struct {
    const char *ending, *words;
    kmp_mesh_reader *read;
} formats[] = {
#define KMP_MESH_FORMAT(ending, words, reader) {ending, words, reader},
#include "exchange/finite_elements/mesh_formats.def"
#undef KMP_MESH_FORMAT
};

static kempe_status make_matrices(kmp_finite_mesh *mesh)
{
    kmp_mesh_rows wide;
    const int rows = mesh->mass_width * mesh->node_count;
    if (!gather(mesh, &mesh->stiffness_read, 3 * mesh->node_count, &mesh->stiffness) ||
        !gather(mesh, &mesh->mass_read, rows, mesh->mass_width == 1 ? &mesh->mass : &wide))
        return kmp_fail_memory(mesh->context);
    KMP_TRY(check_rows(mesh, "stiffness", 3, &mesh->stiffness));
    KMP_TRY(check_rows(mesh, "mass", mesh->mass_width, mesh->mass_width == 1 ? &mesh->mass : &wide));
    if (mesh->mass_width == 3)
        KMP_TRY(take_scalar_mass(mesh, &wide, &mesh->mass));
    KMP_TRY(check_stiffness(mesh));
    return check_mass(mesh);
}

kempe_status kmp_finite_mesh_read(kempe_context *context, kmp_arena *arena, const char *path,
                                  const kempe_reduce_options *options, kmp_finite_mesh *mesh)
{
    enum { FORMATS = sizeof formats / sizeof *formats };
    int k = 0;
    *mesh = (kmp_finite_mesh){.context = context, .arena = arena, .path = path, .options = options};
    while (k < FORMATS && strcmp(kmp_file_ending(path), formats[k].ending) != 0)
        k++;
    if (k == FORMATS)
        return kmp_mesh_refuse(mesh, "its ending is none of a mesh with matrices: .npz (arrays), .mtx (Matrix Market, "
                                     "the stiffness) or .sti (CalculiX)");
    mesh->format = formats[k].words;
    KMP_TRY(formats[k].read(mesh));
    KMP_TRY(check_nodes(mesh));
    KMP_TRY(leave_out_unused(mesh));
    if (mesh->node_count == 0)
        return kmp_mesh_refuse(mesh, "no node has stiffness and mass");
    KMP_TRY(make_matrices(mesh));
    return take_units(mesh);
}
