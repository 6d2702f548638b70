/* SPDX-License-Identifier: BSD-3-Clause */
/* Pairs of matrices in the format Matrix Market (Boisvert, Pozo, Remington, NISTIR 5935, 1996), and a text with the
 * places of the nodes. */
#include "exchange/finite_elements/finite_mesh.h"
#include "exchange/finite_elements/number_lines.h"
#include <ctype.h>
#include <limits.h>
#include <math.h>
#include <string.h>

/* The head of a matrix. */
typedef struct market {
    bool symmetric;
    double rows, cols, entries;
} market;

static bool is_word(const char **at, const char *word)
{
    const size_t length = strlen(word);
    *at += strspn(*at, " \t\r");
    for (size_t k = 0; k < length; k++)
        if (tolower((unsigned char)(*at)[k]) != word[k])
            return false;
    *at += length;
    return !**at || strchr(" \t\r", **at);
}

static kempe_status take_head(kmp_number_lines *lines, market *head)
{
    const char *at = kmp_number_lines_next(lines) ? lines->now : "";
    const bool good = is_word(&at, "%%matrixmarket") && is_word(&at, "matrix") && is_word(&at, "coordinate") &&
                      (is_word(&at, "real") || is_word(&at, "integer") || is_word(&at, "double"));
    const char *kind = at;
    head->symmetric = good && is_word(&at, "symmetric");
    at = head->symmetric ? at : kind;
    if (!good || (!head->symmetric && !is_word(&at, "general")))
        return kmp_number_lines_refuse(lines, NULL,
                                       "the line '%%%%MatrixMarket matrix coordinate real symmetric', or .. general, "
                                       "is expected");
    do
        if (!kmp_number_lines_next(lines))
            return kmp_number_lines_refuse(lines, NULL, "it ends before the numbers of rows, columns and entries");
    while (*lines->now == '%');
    double sizes[3] = {0};
    KMP_TRY(kmp_number_lines_take(lines, 3, sizes, "the numbers of rows, columns and entries are"));
    for (int k = 0; k < 3; k++)
        if (!(sizes[k] >= 1 && sizes[k] < INT_MAX / 2 && sizes[k] == floor(sizes[k])))
            return kmp_number_lines_refuse(lines, NULL,
                                           "the numbers of rows, columns and entries are %g, %g and %g: whole and "
                                           "positive numbers are expected",
                                           sizes[0], sizes[1], sizes[2]);
    *head = (market){head->symmetric, sizes[0], sizes[1], sizes[2]};
    return head->rows == head->cols
               ? KEMPE_OK
               : kmp_number_lines_refuse(lines, NULL, "the matrix is %g x %g: it must be square", sizes[0], sizes[1]);
}

static kempe_status take_entries(kmp_number_lines *lines, const market *head, kmp_arena *arena, kmp_mesh_entries *to)
{
    double count = 0, e[3] = {0};
    to->triangle = head->symmetric;
    while (kmp_number_lines_next(lines)) {
        if (*lines->now == '%')
            continue;
        KMP_TRY(kmp_number_lines_take(lines, 3, e, "a row, a column and a value are"));
        for (int k = 0; k < 2; k++)
            if (!(e[k] >= 1 && e[k] <= head->rows && e[k] == floor(e[k])))
                return kmp_number_lines_refuse(lines, NULL, "%s %g is none of 1 to %g", k ? "column" : "row", e[k],
                                               head->rows);
        if (head->symmetric && e[1] > e[0])
            return kmp_number_lines_refuse(
                lines, NULL, "entry (%g, %g) is above the diagonal: a symmetric matrix has only entries below it", e[0],
                e[1]);
        if (!kmp_mesh_add(arena, to, (int)e[0] - 1, (int)e[1] - 1, e[2]))
            return kmp_fail_memory(lines->context);
        count++;
    }
    return count == head->entries
               ? KEMPE_OK
               : kmp_number_lines_refuse(lines, NULL, "it has %g entries, its head says %g", count, head->entries);
}

static kempe_status read_matrix(const kmp_finite_mesh *mesh, const char *path, market *head, kmp_mesh_entries *to)
{
    kmp_number_lines lines;
    kempe_status status = kmp_number_lines_open(mesh->context, KMP_FILE_MATRIX, path, &lines);
    if (status == KEMPE_OK)
        status = take_head(&lines, head);
    if (status == KEMPE_OK)
        status = take_entries(&lines, head, mesh->arena, to);
    kmp_number_lines_close(&lines);
    return status;
}

/* A line "x y z" for each node, in the order of the rows, or "number x y z"; a first line of words is passed over. */
static kempe_status take_places(kmp_number_lines *lines, kmp_finite_mesh *mesh)
{
    long *number = NULL;
    for (bool first = true; kmp_number_lines_next(lines); first = false) {
        const char *at = lines->now;
        double x[4];
        int count = 0;
        if (*at == '#' || *at == '%' || (first && isalpha((unsigned char)at[strspn(at, " \t\"")])))
            continue;
        while (count < 4 && kmp_number_take(&at, &x[count]))
            count++;
        if (!kmp_number_line_ends(at) || count < 3 || (mesh->node_count > 0 && (count == 4) != !!number))
            return kmp_number_lines_refuse(lines, at,
                                           "x, y and z of a node are expected, or in all lines its number and these");
        double *node = kmp_arena_room(mesh->arena, mesh->node, mesh->node_count, 3 * sizeof *node);
        long *numbers = count == 4 ? kmp_arena_room(mesh->arena, number, mesh->node_count, sizeof *numbers) : NULL;
        if (!node || (count == 4 && !numbers))
            return kmp_fail_memory(mesh->context);
        if (count == 4) {
            if (!(x[0] >= 0 && x[0] < INT_MAX && x[0] == floor(x[0])) ||
                (mesh->node_count > 0 && x[0] <= (double)numbers[mesh->node_count - 1]))
                return kmp_number_lines_refuse(lines, NULL,
                                               "node number %g: whole numbers from 0 on are expected, in ascending "
                                               "order",
                                               x[0]);
            numbers[mesh->node_count] = (long)x[0];
        }
        number = numbers;
        mesh->node = node;
        memcpy(node + 3 * (ptrdiff_t)mesh->node_count++, x + (count == 4), 3 * sizeof *node);
    }
    mesh->number = number;
    return KEMPE_OK;
}

static kempe_status read_places(kmp_finite_mesh *mesh, const char *path)
{
    kmp_number_lines lines;
    kempe_status status = kmp_number_lines_open(mesh->context, KMP_FILE_MATRIX, path, &lines);
    if (status == KEMPE_OK)
        status = take_places(&lines, mesh);
    kmp_number_lines_close(&lines);
    return status;
}

kempe_status kmp_matrix_market_read(kmp_finite_mesh *mesh)
{
    const kempe_reduce_options *o = mesh->options;
    market stiffness = {0}, mass = {0};
    if (!o->mass || !o->nodes)
        return kmp_fail(
            mesh->context, KEMPE_E_ARGUMENT,
            "%s has only the stiffness: give the mass by --mass M.mtx, and the places of the nodes by --nodes FILE",
            mesh->path);
    KMP_TRY(read_matrix(mesh, mesh->path, &stiffness, &mesh->stiffness_read));
    KMP_TRY(read_matrix(mesh, o->mass, &mass, &mesh->mass_read));
    KMP_TRY(read_places(mesh, o->nodes));
    const double n = mesh->node_count;
    if (stiffness.rows != 3 * n)
        return kmp_mesh_refuse(
            mesh, "the stiffness has %g rows, and there are %g nodes: three rows a node are expected%s", stiffness.rows,
            n, stiffness.rows == 6 * n ? "; rotations of nodes, as beams and shells have, are not reduced" : "");
    mesh->mass_width = mass.rows == n ? 1 : 3;
    if (mass.rows != n && mass.rows != 3 * n)
        return kmp_mesh_refuse(mesh,
                               "the mass has %g rows, and there are %g nodes: one row or three rows a node are "
                               "expected",
                               mass.rows, n);
    return KEMPE_OK;
}
