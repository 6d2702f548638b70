/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes as arrays in an .npz: nodes, and the matrices as entries (X_row, X_col, X_value) or as compressed rows
 * (X_indptr, X_indices, X_data), X being stiffness and mass. */
#include "base/file.h"
#include "base/memory.h"
#include "exchange/finite_elements/finite_mesh.h"
#include "model/files/npz.h"
#include <limits.h>
#include <math.h>

typedef struct arrays {
    kmp_finite_mesh *mesh;
    kmp_npz npz;
} arrays;

static const char *name_of(const arrays *a, const char *matrix, const char *part)
{
    return kmp_arena_printf(a->mesh->arena, "%s_%s", matrix, part);
}

/* Numbers, or words; `rank` -1: any. */
static kempe_status take(const arrays *a, const char *name, bool words, int rank, kmp_npz_array *array)
{
    kmp_text why = {0};
    if (!name)
        return kmp_fail_memory(a->mesh->context);
    const bool good = kmp_npz_array_read(&a->npz, name, array, &why);
    kempe_status status = KEMPE_OK;
    if (!good && why.s)
        status = kmp_mesh_refuse(a->mesh, "array '%s': %s", name, why.s);
    else if (!good)
        status = kmp_fail_memory(a->mesh->context);
    else if (words != !!array->word || (words && array->count < 1))
        status = kmp_mesh_refuse(a->mesh, "array '%s': %s are expected", name, words ? "words" : "numbers");
    else if (rank >= 0 && array->rank != rank)
        status = kmp_mesh_refuse(a->mesh, "array '%s' has %d dimensions: %d %s expected", name, array->rank, rank,
                                 rank == 1 ? "is" : "are");
    kmp_text_free(&why);
    return status;
}

static kempe_status take_list(const arrays *a, const char *matrix, const char *part, size_t count, kmp_npz_array *list)
{
    const char *name = name_of(a, matrix, part);
    KMP_TRY(take(a, name, false, 1, list));
    return count == 0 || list->count == count
               ? KEMPE_OK
               : kmp_mesh_refuse(a->mesh, "array '%s' has %zu entries: %zu are expected", name, list->count, count);
}

/* A row or column; `most` is the largest one so far. */
static kempe_status take_index(const arrays *a, const char *matrix, double index, size_t entry, double *most)
{
    const double rows = 6 * (double)a->mesh->node_count; /* with rotations, which have a separate message */
    if (!(index >= 0 && index < rows && index == floor(index)))
        return kmp_mesh_refuse(a->mesh,
                               "matrix '%s': entry %zu is in row or column %g; there are %d nodes, and rows are "
                               "counted from 0",
                               matrix, entry, index, a->mesh->node_count);
    *most = fmax(*most, index);
    return KEMPE_OK;
}

static kempe_status take_entry(const arrays *a, const char *matrix, size_t k, double row, double col, double value,
                               double *most, kmp_mesh_entries *to)
{
    KMP_TRY(take_index(a, matrix, row, k, most));
    KMP_TRY(take_index(a, matrix, col, k, most));
    return kmp_made(a->mesh->context, kmp_mesh_add(a->mesh->arena, to, (int)row, (int)col, value));
}

static kempe_status take_compressed(const arrays *a, const char *matrix, double *most, kmp_mesh_entries *to)
{
    kmp_npz_array start, col, value;
    KMP_TRY(take_list(a, matrix, "data", 0, &value));
    KMP_TRY(take_list(a, matrix, "indices", value.count, &col));
    KMP_TRY(take_list(a, matrix, "indptr", 0, &start));
    bool good = start.count > 1 && start.value[0] == 0 && start.value[start.count - 1] == (double)value.count;
    for (size_t i = 0; i + 1 < start.count && good; i++)
        good = start.value[i] <= start.value[i + 1] && start.value[i] == floor(start.value[i]);
    if (!good)
        return kmp_mesh_refuse(a->mesh, "array '%s_indptr' does not ascend from 0 to the %zu entries of '%s_data'",
                               matrix, value.count, matrix);
    for (size_t i = 0; i + 1 < start.count; i++)
        for (size_t k = (size_t)start.value[i]; k < (size_t)start.value[i + 1]; k++)
            KMP_TRY(take_entry(a, matrix, k, (double)i, col.value[k], value.value[k], most, to));
    return KEMPE_OK;
}

static kempe_status take_triplets(const arrays *a, const char *matrix, double *most, kmp_mesh_entries *to)
{
    kmp_npz_array row, col, value;
    KMP_TRY(take_list(a, matrix, "value", 0, &value));
    KMP_TRY(take_list(a, matrix, "row", value.count, &row));
    KMP_TRY(take_list(a, matrix, "col", value.count, &col));
    for (size_t k = 0; k < value.count; k++)
        KMP_TRY(take_entry(a, matrix, k, row.value[k], col.value[k], value.value[k], most, to));
    return KEMPE_OK;
}

/* *width: rows for each node, by the largest row. */
static kempe_status take_matrix(const arrays *a, const char *matrix, int *width, kmp_mesh_entries *to)
{
    const char *data = name_of(a, matrix, "data"), *value = name_of(a, matrix, "value");
    double most = 0;
    if (!data || !value)
        return kmp_fail_memory(a->mesh->context);
    if (!kmp_npz_has(&a->npz, data) && !kmp_npz_has(&a->npz, value))
        return kmp_mesh_refuse(a->mesh,
                               "it has no matrix '%s': the arrays '%s_row', '%s_col' and '%s_value', or '%s_indptr', "
                               "'%s_indices' and '%s_data', are expected",
                               matrix, matrix, matrix, matrix, matrix, matrix, matrix);
    KMP_TRY(kmp_npz_has(&a->npz, data) ? take_compressed(a, matrix, &most, to) : take_triplets(a, matrix, &most, to));
    const double n = a->mesh->node_count;
    *width = most < n ? 1 : most < 3 * n ? 3 : 6;
    return *width < 6 ? KEMPE_OK
                      : kmp_mesh_refuse(a->mesh,
                                        "matrix '%s' has row %g, and there are %g nodes: three rows a node are "
                                        "expected; rotations of nodes, as beams and shells have, are not reduced",
                                        matrix, most, n);
}

static kempe_status take_nodes(arrays *a)
{
    kmp_npz_array nodes;
    KMP_TRY(take(a, "nodes", false, 2, &nodes));
    if (nodes.shape[1] != 3 || nodes.shape[0] < 1 || nodes.shape[0] > INT_MAX / 8)
        return kmp_mesh_refuse(a->mesh, "array 'nodes' is %zu x %zu: a row of x, y and z for each node is expected",
                               nodes.shape[0], nodes.shape[1]);
    a->mesh->node_count = (int)nodes.shape[0];
    a->mesh->node = nodes.value;
    return KEMPE_OK;
}

static kempe_status take_all(arrays *a)
{
    kmp_npz_array units;
    int width = 0;
    KMP_TRY(take_nodes(a));
    if (kmp_npz_has(&a->npz, "units")) {
        KMP_TRY(take(a, "units", true, -1, &units));
        a->mesh->units = units.word[0];
    }
    KMP_TRY(take_matrix(a, "stiffness", &width, &a->mesh->stiffness_read));
    if (width != 3)
        return kmp_mesh_refuse(a->mesh,
                               "matrix 'stiffness' has only the rows of %d nodes: three rows a node are expected",
                               a->mesh->node_count);
    return take_matrix(a, "mass", &a->mesh->mass_width, &a->mesh->mass_read);
}

kempe_status kmp_mesh_arrays_read(kmp_finite_mesh *mesh)
{
    arrays a = {.mesh = mesh};
    char *bytes = NULL;
    size_t length;
    kmp_text why = {0};
    KMP_TRY(kmp_file_read(mesh->context, KMP_FILE_MATRIX, mesh->path, &bytes, &length));
    kempe_status status = KEMPE_OK;
    if (!kmp_npz_open(mesh->arena, bytes, length, &a.npz, &why))
        status = why.s ? kmp_mesh_refuse(mesh, "%s", why.s) : kmp_fail_memory(mesh->context);
    else
        status = take_all(&a);
    kmp_text_free(&why);
    kmp_free(bytes);
    return status;
}
