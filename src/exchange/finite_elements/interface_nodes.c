/* SPDX-License-Identifier: BSD-3-Clause */
#include "exchange/finite_elements/interface_nodes.h"
#include "linalg/dense/lapack.h"
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Of the size of the mesh: a node is in a plane. Coordinates in texts have six digits or more. */
static const double IN_PLANE = 1e-6;

/* Of the largest moment of inertia of the nodes about their mean place, that about their line. */
static const double IN_LINE = 1e-9;

enum { INTERFACES_MOST = 100 };

typedef struct reading {
    const kmp_finite_mesh *mesh;
    kmp_interface *interfaces;
    int count;
    bool *taken; /* node_count: nodes of the present interface */
    bool places; /* it has ranges of places: `taken` are the nodes in all of them */
    double size; /* of the mesh */
} reading;

static kempe_status refuse_word(const reading *r, const char *word)
{
    return kmp_fail(r->mesh->context, KEMPE_E_ARGUMENT,
                    "--interface: '%s' is none of a name with nodes, 'root=1,2,5-9', a set of nodes, 'root=SET', or a "
                    "range of places, 'root=x=0' or 'root=x=0:0.1'",
                    word);
}

/* -- nodes ------------------------------------------------------------------------------------------- */

/* "7" or "7-12"; false: it is neither. */
static bool take_range(const char *word, long *first, long *last)
{
    char *end;
    if (!*word || word[strspn(word, "0123456789-")] || *word == '-')
        return false;
    *first = *last = strtol(word, &end, 10);
    if (*end == '-' && end[1] && end[1] != '-')
        *last = strtol(end + 1, &end, 10);
    return !*end && *first <= *last;
}

static kempe_status take_numbers(const reading *r, long first, long last)
{
    const kmp_finite_mesh *mesh = r->mesh;
    const kmp_interface *own = &r->interfaces[r->count - 1];
    if (last - first >= mesh->node_count)
        return kmp_mesh_refuse(mesh, "interface '%s': the nodes %ld to %ld are more than the %d of the mesh", own->name,
                               first, last, mesh->node_count);
    for (long number = first; number <= last; number++) {
        const int node = kmp_mesh_find(mesh, number);
        if (node < 0)
            return kmp_mesh_refuse(mesh, "interface '%s': there is no node %ld; its nodes are %ld to %ld%s", own->name,
                                   number, kmp_mesh_number(mesh, 0), kmp_mesh_number(mesh, mesh->node_count - 1),
                                   mesh->unused > 0 ? ", and nodes without stiffness and mass are not in it" : "");
        r->taken[node] = true;
    }
    return KEMPE_OK;
}

/* -- places ------------------------------------------------------------------------------------------ */

static bool take_number(const char **at, double *x)
{
    const bool negative = **at == '-';
    const char *from = *at + negative;
    const size_t length = kmp_text_to_number(from, x);
    *x = negative ? -*x : *x;
    *at = from + length;
    return length > 0 && isfinite(*x);
}

/* "0.5" or "0:0.5", in the unit of the file. */
static bool take_interval(const char *word, double low_high[2])
{
    if (!take_number(&word, &low_high[0]))
        return false;
    low_high[1] = low_high[0];
    return (*word != ':' || (++word, take_number(&word, &low_high[1]))) && !*word && low_high[0] <= low_high[1];
}

/* "x=0:0.5": nodes in this range, and in those before it. */
static kempe_status take_place(reading *r, const char *word)
{
    const kmp_finite_mesh *mesh = r->mesh;
    double range[2];
    if (r->count == 0 || !take_interval(word + 2, range))
        return refuse_word(r, word);
    for (int k = 0; k < mesh->node_count; k++) {
        const double x = mesh->node[3 * (ptrdiff_t)k + (*word - 'x')];
        if (!r->places && r->taken[k])
            return refuse_word(r, word); /* numbers before it */
        r->taken[k] = (!r->places || r->taken[k]) && x >= range[0] * mesh->length - IN_PLANE * r->size &&
                      x <= range[1] * mesh->length + IN_PLANE * r->size;
    }
    r->places = true;
    return KEMPE_OK;
}

/* -- interfaces -------------------------------------------------------------------------------------- */

/* Three nodes or more that are not in a line, so that displacements say how they turn. */
static kempe_status check_spread(const reading *r, const kmp_interface *own)
{
    double mean[3] = {0}, second[9] = {0}, values[3];
    for (int k = 0; k < own->count; k++)
        for (int i = 0; i < 3; i++)
            mean[i] += r->mesh->node[3 * (ptrdiff_t)own->nodes[k] + i] / own->count;
    for (int k = 0; k < own->count; k++) {
        double x[3], square = 0;
        for (int i = 0; i < 3; i++) {
            x[i] = r->mesh->node[3 * (ptrdiff_t)own->nodes[k] + i] - mean[i];
            square += x[i] * x[i];
        }
        for (int i = 0; i < 9; i++)
            second[i] += (i % 4 == 0 ? square : 0) - x[i / 3] * x[i % 3];
    }
    if (kmp_symmetric_eigen(3, second, values) != 0)
        return kmp_fail_memory(r->mesh->context);
    if (own->count >= 3 && values[0] > IN_LINE * values[2])
        return KEMPE_OK;
    return kmp_mesh_refuse(r->mesh,
                           "interface '%s' has %d node%s%s: a rigid body needs three nodes or more that are not in a "
                           "line; other nodes are points of the body, {node: %ld}",
                           own->name, own->count, own->count == 1 ? "" : "s", own->count >= 3 ? " in a line" : "",
                           own->count > 0 ? kmp_mesh_number(r->mesh, own->nodes[0]) : 0);
}

static kempe_status end_interface(reading *r)
{
    if (r->count == 0)
        return KEMPE_OK;
    kmp_interface *own = &r->interfaces[r->count - 1];
    own->nodes = KMP_ARENA_NEW(r->mesh->arena, int, r->mesh->node_count);
    if (!own->nodes)
        return kmp_fail_memory(r->mesh->context);
    for (int k = 0; k < r->mesh->node_count; k++)
        if (r->taken[k])
            own->nodes[own->count++] = k;
    if (own->count == 0)
        return kmp_mesh_refuse(r->mesh, "interface '%s' has no nodes: no place of a node is there", own->name);
    memset(r->taken, 0, (size_t)r->mesh->node_count * sizeof *r->taken);
    r->places = false;
    return check_spread(r, own);
}

static kempe_status begin_interface(reading *r, const char *name)
{
    KMP_TRY(end_interface(r));
    for (int k = 0; k < r->count; k++)
        if (strcmp(r->interfaces[k].name, name) == 0)
            return kmp_fail(r->mesh->context, KEMPE_E_ARGUMENT, "--interface: '%s' is named twice", name);
    if (r->count == INTERFACES_MOST)
        return kmp_fail(r->mesh->context, KEMPE_E_ARGUMENT, "--interface: at most %d are taken", INTERFACES_MOST);
    r->interfaces[r->count++] = (kmp_interface){.name = name};
    return KEMPE_OK;
}

static kempe_status take_word(reading *r, char *word)
{
    for (char *equals = strchr(word, '='); equals; equals = strchr(word, '=')) {
        if (equals == word + 1 && *word >= 'x' && *word <= 'z' && !strchr(equals + 1, '='))
            return take_place(r, word);
        *equals = '\0';
        if (!*word || word[strspn(word, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_")] ||
            strchr("0123456789", *word))
            return kmp_fail(r->mesh->context, KEMPE_E_ARGUMENT,
                            "--interface: '%s' is not a name: letters, digits and _ are allowed, a letter first", word);
        KMP_TRY(begin_interface(r, word));
        word = equals + 1;
    }
    long first, last;
    const kmp_node_set *set = NULL;
    for (int k = 0; k < r->mesh->set_count && !set; k++)
        if (strcasecmp(r->mesh->sets[k].name, word) == 0)
            set = &r->mesh->sets[k];
    if (r->count == 0 || r->places || (!set && !take_range(word, &first, &last)))
        return refuse_word(r, word);
    for (int k = 0; set && k < set->count; k++)
        r->taken[set->nodes[k]] = true;
    return set ? KEMPE_OK : take_numbers(r, first, last);
}

static double size_of(const kmp_finite_mesh *mesh)
{
    double square = 0;
    for (int i = 0; i < 3; i++) {
        double low = mesh->node[i], high = low;
        for (int k = 1; k < mesh->node_count; k++) {
            low = fmin(low, mesh->node[3 * (ptrdiff_t)k + i]);
            high = fmax(high, mesh->node[3 * (ptrdiff_t)k + i]);
        }
        square += (high - low) * (high - low);
    }
    return sqrt(square);
}

static kempe_status check_apart(const reading *r)
{
    for (int k = 0; k < r->count; k++)
        for (int i = 0; i < r->interfaces[k].count; i++) {
            const int node = r->interfaces[k].nodes[i];
            if (r->taken[node])
                return kmp_mesh_refuse(r->mesh, "node %ld is in interface '%s' and in one before it: it moves with one",
                                       kmp_mesh_number(r->mesh, node), r->interfaces[k].name);
            r->taken[node] = true;
        }
    return KEMPE_OK;
}

kempe_status kmp_interfaces_read(const kmp_finite_mesh *mesh, const char *words, int *count, kmp_interface **interfaces)
{
    char **word;
    const int words_count = kmp_text_words(mesh->arena, words, &word);
    reading r = {.mesh = mesh, .size = size_of(mesh)};
    if (!KMP_ARENA_MAKE(mesh->arena, KMP_ROOM(kmp_interface, INTERFACES_MOST, &r.interfaces),
                        KMP_ROOM(bool, mesh->node_count, &r.taken)))
        return kmp_fail_memory(mesh->context);
    if (words_count == 0)
        return kmp_fail(mesh->context, KEMPE_E_ARGUMENT,
                        "interfaces are missing: name the nodes that joints hold, --interface root=x=0 or --interface "
                        "root=1,2,5-9; the first one is held by the joint of the body");
    for (int k = 0; k < words_count; k++)
        KMP_TRY(take_word(&r, word[k]));
    KMP_TRY(end_interface(&r));
    KMP_TRY(check_apart(&r));
    *count = r.count;
    *interfaces = r.interfaces;
    return KEMPE_OK;
}
