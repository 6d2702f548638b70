/* SPDX-License-Identifier: BSD-3-Clause */
/* Matrices of CalculiX, stored by *FREQUENCY with SOLVER=MATRIXSTORAGE: JOB.sti and JOB.mas have lines "row column
 * value" of one triangle, JOB.dof a line "node.direction" for each row (version 2.20). The nodes are taken from
 * the input, JOB.inp. */
#include "exchange/finite_elements/finite_mesh.h"
#include "exchange/finite_elements/number_lines.h"
#include <ctype.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct input_node {
    long number;
    double x[3];
} input_node;

/* A member of a set of nodes, in the order of the input. */
typedef struct member {
    int set;
    long node;
} member;

typedef struct input {
    kmp_finite_mesh *mesh;
    kmp_number_lines lines;
    int node_count, member_count, set_count;
    input_node *nodes;
    member *members;
    const char **sets;
    /* The keyword of the lines that follow. */
    bool nodes_follow, members_follow, generate;
    int set; /* of these lines; -1: none */
} input;

/* -- the input --------------------------------------------------------------------------------------- */

/* The value of "NAME=.." in the line of a keyword, in the arena, without blanks; NULL: it is not there. */
static const char *parameter_of(const input *in, const char *name)
{
    const char *at = in->lines.now;
    while ((at = strchr(at, ','))) {
        at += 1 + strspn(at + 1, " \t");
        const size_t length = strlen(name);
        if (strncasecmp(at, name, length) != 0)
            continue;
        const char *after = at + length + strspn(at + length, " \t");
        if (*after == '=')
            return kmp_arena_printf(in->mesh->arena, "%.*s", (int)strcspn(after + 1 + strspn(after + 1, " "), ", \t\r"),
                                    after + 1 + strspn(after + 1, " "));
        if (!*after || strchr(",\r", *after))
            return "";
    }
    return NULL;
}

/* The number of a set, which is added where it is new; -1: no memory. */
static int set_of(input *in, const char *name, bool add)
{
    for (int k = 0; k < in->set_count; k++)
        if (strcasecmp(in->sets[k], name) == 0)
            return k;
    const char **sets = add ? kmp_arena_room(in->mesh->arena, in->sets, in->set_count, sizeof *sets) : NULL;
    if (!sets)
        return -1;
    in->sets = sets;
    sets[in->set_count] = name;
    return in->set_count++;
}

static bool add_member(input *in, int set, long node)
{
    member *members = kmp_arena_room(in->mesh->arena, in->members, in->member_count, sizeof *members);
    if (!members)
        return false;
    in->members = members;
    members[in->member_count++] = (member){set, node};
    return true;
}

static kempe_status take_keyword(input *in)
{
    const char *line = in->lines.now;
    const size_t length = strcspn(line, ", \t\r");
    const bool nodes = length == 5 && strncasecmp(line, "*NODE", 5) == 0;
    const bool members = length == 5 && strncasecmp(line, "*NSET", 5) == 0;
    in->nodes_follow = nodes;
    in->members_follow = members;
    in->set = -1;
    if (length == 8 && strncasecmp(line, "*INCLUDE", 8) == 0)
        return kmp_number_lines_refuse(&in->lines, NULL,
                                       "*INCLUDE is not followed: give the file with the nodes by --nodes FILE");
    const char *name = nodes || members ? parameter_of(in, "NSET") : NULL;
    in->generate = members && parameter_of(in, "GENERATE");
    if (in->mesh->arena->failed)
        return kmp_fail_memory(in->mesh->context);
    if (members && (!name || !*name))
        return kmp_number_lines_refuse(&in->lines, NULL, "*NSET needs its name, NSET=NAME");
    if (name && *name && (in->set = set_of(in, name, true)) < 0)
        return kmp_fail_memory(in->mesh->context);
    return KEMPE_OK;
}

static bool is_number(double x)
{
    return x >= 1 && x < INT_MAX && x == floor(x);
}

static kempe_status take_node(input *in)
{
    double x[4] = {0};
    const char *at = in->lines.now;
    int count = 0;
    while (count < 4 && kmp_number_take(&at, &x[count]))
        count++;
    if (count < 2 || !kmp_number_line_ends(at) || !is_number(x[0])) /* absent places are zero */
        return kmp_number_lines_refuse(&in->lines, at, "a node's number, x, y and z are expected");
    input_node *nodes = kmp_arena_room(in->mesh->arena, in->nodes, in->node_count, sizeof *nodes);
    if (!nodes || (in->set >= 0 && !add_member(in, in->set, (long)x[0])))
        return kmp_fail_memory(in->mesh->context);
    in->nodes = nodes;
    nodes[in->node_count++] = (input_node){(long)x[0], {x[1], x[2], x[3]}};
    return KEMPE_OK;
}

/* Nodes of a set: numbers, names of sets before it, or with GENERATE first, last and step. */
static kempe_status take_members(input *in)
{
    const char *at = in->lines.now;
    double x, range[3] = {0, 0, 1};
    int count = 0;
    bool made = true;
    while (!kmp_number_line_ends(at) && made) {
        if (kmp_number_take(&at, &x)) {
            if (!is_number(x) || (in->generate && count > 2))
                return kmp_number_lines_refuse(&in->lines, at, "numbers of nodes are expected, not %g", x);
            if (in->generate)
                range[count++] = x;
            else
                made = add_member(in, in->set, (long)x);
            continue;
        }
        const size_t length = strcspn(at, ", \t\r");
        const char *name = kmp_arena_printf(in->mesh->arena, "%.*s", (int)length, at);
        const int other = name ? set_of(in, name, false) : -1, before = in->member_count;
        if (name && (other < 0 || other == in->set))
            return kmp_number_lines_refuse(&in->lines, at, "there is no set '%s' of nodes before this line", name);
        for (int k = 0; k < before && made; k++)
            made = in->members[k].set != other || add_member(in, in->set, in->members[k].node);
        made = made && name;
        at += length;
    }
    if (in->generate && (count < 2 || (range[1] - range[0]) / range[2] > INT_MAX / 8))
        return kmp_number_lines_refuse(&in->lines, NULL, "the first node, the last one and the step are expected");
    for (double node = range[0]; in->generate && node <= range[1] && made; node += range[2])
        made = add_member(in, in->set, (long)node);
    return kmp_made(in->mesh->context, made);
}

static kempe_status take_input(input *in)
{
    while (kmp_number_lines_next(&in->lines)) {
        const char *line = in->lines.now;
        if (line[0] == '*' && line[1] == '*')
            continue;
        if (line[0] == '*')
            KMP_TRY(take_keyword(in));
        else if (in->nodes_follow)
            KMP_TRY(take_node(in));
        else if (in->members_follow)
            KMP_TRY(take_members(in));
    }
    return in->node_count > 0
               ? KEMPE_OK
               : kmp_fail(in->mesh->context, KEMPE_E_INPUT,
                          "%s: it has no nodes, lines behind *NODE: give their file by --nodes FILE", in->lines.path);
}

static int compare_nodes(const void *a, const void *b)
{
    const input_node *x = a, *y = b;
    return (x->number > y->number) - (x->number < y->number);
}

static kempe_status read_input(input *in, const char *path)
{
    kempe_status status = kmp_number_lines_open(in->mesh->context, KMP_FILE_MATRIX, path, &in->lines);
    if (status == KEMPE_OK)
        status = take_input(in);
    kmp_number_lines_close(&in->lines);
    if (status != KEMPE_OK)
        return status;
    qsort(in->nodes, (size_t)in->node_count, sizeof *in->nodes, compare_nodes);
    for (int k = 1; k < in->node_count; k++)
        if (in->nodes[k].number == in->nodes[k - 1].number)
            return kmp_fail(in->mesh->context, KEMPE_E_INPUT, "%s: node %ld is given twice", path, in->nodes[k].number);
    return KEMPE_OK;
}

static int input_place(const input *in, long number)
{
    const input_node key = {.number = number},
                     *found = bsearch(&key, in->nodes, (size_t)in->node_count, sizeof key, compare_nodes);
    return found ? (int)(found - in->nodes) : -1;
}

/* -- the rows ---------------------------------------------------------------------------------------- */

/* JOB.ENDING in the folder of JOB.sti. */
static const char *beside(const kmp_finite_mesh *mesh, const char *ending)
{
    return kmp_arena_printf(mesh->arena, "%.*s%s", (int)(strlen(mesh->path) - strlen(kmp_file_ending(mesh->path))),
                            mesh->path, ending);
}

/* row (of each equation): 3 node + direction, of all nodes of the input. */
static kempe_status take_equations(input *in, int **row, int *count)
{
    kmp_number_lines *lines = &in->lines;
    while (kmp_number_lines_next(lines)) {
        char *end;
        const char *at = lines->now + strspn(lines->now, " \t");
        const long node = strtol(at, &end, 10);
        const int way = *end == '.' && isdigit((unsigned char)end[1]) ? end[1] - '0' : 0;
        const int place = input_place(in, node);
        if (end == at || way == 0 || !kmp_number_line_ends(end + 2))
            return kmp_number_lines_refuse(
                lines, at, "a node and a direction, as 12.1, are expected: an equation of a displacement");
        if (way > 3)
            return kmp_number_lines_refuse(
                lines, at,
                "node %ld has a rotation, direction %d: bodies of solid elements are reduced, "
                "beams, shells and rigid bodies are not",
                node, way);
        if (place < 0)
            return kmp_number_lines_refuse(lines, at, "the input has no node %ld: give its file by --nodes FILE", node);
        int *rows = kmp_arena_room(in->mesh->arena, *row, *count, sizeof *rows);
        if (!rows)
            return kmp_fail_memory(in->mesh->context);
        *row = rows;
        rows[(*count)++] = 3 * place + way - 1;
    }
    return KEMPE_OK;
}

static kempe_status take_entries(kmp_number_lines *lines, kmp_arena *arena, const int *row, int count,
                                 kmp_mesh_entries *to)
{
    double e[3] = {0};
    to->triangle = true;
    while (kmp_number_lines_next(lines)) {
        KMP_TRY(kmp_number_lines_take(lines, 3, e, "a row, a column and a value are"));
        for (int k = 0; k < 2; k++)
            if (!(e[k] >= 1 && e[k] <= count && e[k] == floor(e[k])))
                return kmp_number_lines_refuse(lines, NULL, "%s %g is none of 1 to %d, the equations in the file .dof",
                                               k ? "column" : "row", e[k], count);
        if (e[0] > e[1])
            return kmp_number_lines_refuse(
                lines, NULL, "entry (%g, %g) is below the diagonal: only entries above it are expected", e[0], e[1]);
        if (!kmp_mesh_add(arena, to, row[(int)e[0] - 1], row[(int)e[1] - 1], e[2]))
            return kmp_fail_memory(lines->context);
    }
    return KEMPE_OK;
}

static kempe_status read_matrix(const kmp_finite_mesh *mesh, const char *path, const int *row, int count,
                                kmp_mesh_entries *to)
{
    kmp_number_lines lines;
    KMP_TRY(kmp_made(mesh->context, path));
    kempe_status status = kmp_number_lines_open(mesh->context, KMP_FILE_MATRIX, path, &lines);
    if (status == KEMPE_OK)
        status = take_entries(&lines, mesh->arena, row, count, to);
    kmp_number_lines_close(&lines);
    return status;
}

/* Nodes and sets of the input become nodes and sets of the mesh; nodes without equations are left out with the unused
 * ones. */
static kempe_status give_nodes(const input *in)
{
    kmp_finite_mesh *mesh = in->mesh;
    long *number;
    int *nodes;
    if (!KMP_ARENA_MAKE(mesh->arena, KMP_ROOM(long, in->node_count, &number),
                        KMP_ROOM(double, 3 * (ptrdiff_t)in->node_count, &mesh->node),
                        KMP_ROOM(kmp_node_set, in->set_count, &mesh->sets),
                        KMP_ROOM(int, in->member_count + 1, &nodes)))
        return kmp_fail_memory(mesh->context);
    mesh->node_count = in->node_count;
    mesh->number = number;
    for (int k = 0; k < in->node_count; k++) {
        number[k] = in->nodes[k].number;
        memcpy(mesh->node + 3 * (ptrdiff_t)k, in->nodes[k].x, sizeof in->nodes[k].x);
    }
    mesh->set_count = in->set_count;
    for (int s = 0; s < in->set_count; s++) {
        mesh->sets[s] = (kmp_node_set){.name = in->sets[s], .nodes = nodes};
        for (int k = 0; k < in->member_count; k++) {
            const int place = in->members[k].set == s ? input_place(in, in->members[k].node) : -1;
            if (place >= 0)
                nodes[mesh->sets[s].count++] = place;
        }
        nodes += mesh->sets[s].count;
    }
    return KEMPE_OK;
}

kempe_status kmp_calculix_read(kmp_finite_mesh *mesh)
{
    const char *nodes = mesh->options->nodes ? mesh->options->nodes : beside(mesh, ".inp"), *dof = beside(mesh, ".dof");
    input in = {.mesh = mesh, .set = -1};
    int *row = NULL, count = 0;
    if (mesh->options->mass)
        return kmp_fail(mesh->context, KEMPE_E_ARGUMENT,
                        "--mass belongs to a matrix .mtx: the mass of %s has its own file in the same folder",
                        mesh->path);
    if (!nodes || !dof)
        return kmp_fail_memory(mesh->context);
    KMP_TRY(read_input(&in, nodes));
    kempe_status status = kmp_number_lines_open(mesh->context, KMP_FILE_MATRIX, dof, &in.lines);
    if (status == KEMPE_OK)
        status = take_equations(&in, &row, &count);
    kmp_number_lines_close(&in.lines);
    KMP_TRY(status);
    mesh->mass_width = 3;
    KMP_TRY(read_matrix(mesh, mesh->path, row, count, &mesh->stiffness_read));
    KMP_TRY(read_matrix(mesh, beside(mesh, ".mas"), row, count, &mesh->mass_read));
    return give_nodes(&in);
}
