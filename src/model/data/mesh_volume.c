/* SPDX-License-Identifier: BSD-3-Clause */
/* Volume, centre and inertia of a closed mesh by the divergence theorem: sums over tetrahedra from one place to each
 * triangle (Mirtich, Fast and accurate computation of polyhedral mass properties, Journal of Graphics Tools 1, 1996;
 * the moments of a tetrahedron: Tonon, Journal of Mathematics and Statistics 1, 2004). A surface is closed and faces
 * one way if as many triangles pass each edge in one direction as in the other. */
#include "model/data/mesh_volume.h"
#include "base/memory.h"
#include "model/data/mesh.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};

/* -- edges ------------------------------------------------------------------------------------------- */

typedef struct edge {
    int low, high;      /* vertices */
    int count, balance; /* triangles; those from low to high less those from high to low */
} edge;

static edge *find(edge *table, uint32_t slots, int low, int high)
{
    uint64_t h = ((uint64_t)(uint32_t)low << 32 | (uint32_t)high) * 0x9e3779b97f4a7c15u;
    uint32_t k = (uint32_t)(h >> 32) & (slots - 1);
    while (table[k].count > 0 && (table[k].low != low || table[k].high != high))
        k = (k + 1) & (slots - 1);
    return &table[k];
}

static void pass(edge *table, uint32_t slots, int from, int to)
{
    int low = from < to ? from : to, high = from < to ? to : from;
    edge *e = find(table, slots, low, high);
    e->low = low;
    e->high = high;
    e->count++;
    e->balance += from == low ? 1 : -1;
}

static void say_edge(const kmp_mesh *mesh, const edge *e, int count, bool open, kmp_text *why)
{
    const double *a = mesh->vertex[e->low], *b = mesh->vertex[e->high];
    kmp_text_printf(why, "%s: %d edge%s, such as that from [%.6g, %.6g, %.6g] to [%.6g, %.6g, %.6g]",
                    open ? "the mesh is not closed, triangles have no neighbour"
                         : "neighbouring triangles do not face the same way",
                    count, count == 1 ? "" : "s", a[0], a[1], a[2], b[0], b[1], b[2]);
}

/* Reports the first edge without a neighbour, otherwise the first edge whose triangles face opposite ways. */
static void check_edges(const kmp_mesh *mesh, edge *table, uint32_t slots, kmp_text *why)
{
    const edge *first[2] = {NULL, NULL};
    int count[2] = {0, 0};
    for (int k = 0; k < mesh->triangle_count; k++)
        for (int i = 0; i < 3; i++)
            pass(table, slots, mesh->triangle[k][i], mesh->triangle[k][(i + 1) % 3]);
    for (int k = 0; k < mesh->triangle_count; k++)
        for (int i = 0; i < 3; i++) {
            int from = mesh->triangle[k][i], to = mesh->triangle[k][(i + 1) % 3];
            const edge *e = find(table, slots, from < to ? from : to, from < to ? to : from);
            bool even = e->count % 2 == 0;
            if (e->balance == 0)
                continue;
            first[even] = first[even] ? first[even] : e;
            count[even]++; /* once for each of its triangles */
        }
    if (first[0])
        say_edge(mesh, first[0], count[0], true, why);
    else if (first[1])
        say_edge(mesh, first[1], count[1] / 2, false, why);
}

static bool is_closed(const kmp_mesh *mesh, kmp_text *why)
{
    uint32_t slots = 16;
    while (slots < 4 * (uint32_t)mesh->triangle_count)
        slots *= 2;
    edge *table = KMP_NEW(edge, slots);
    why->failed = why->failed || !table;
    if (table)
        check_edges(mesh, table, slots, why);
    kmp_free(table);
    return table && why->length == 0;
}

/* -- integrals --------------------------------------------------------------------------------------- */

typedef struct moments {
    double volume, first[3], second[6]; /* second: integrals of x x, y y, z z, x y, x z, y z */
} moments;

/* The signed volume of the tetrahedron from the origin to a triangle. */
static double tetrahedron(const double a[3], const double b[3], const double c[3])
{
    return (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
            a[2] * (b[0] * c[1] - b[1] * c[0])) /
           6;
}

static double area_of(const double a[3], const double b[3], const double c[3])
{
    double n[3];
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        n[i] = (b[j] - a[j]) * (c[k] - a[k]) - (b[k] - a[k]) * (c[j] - a[j]);
    }
    return hypot(hypot(n[0], n[1]), n[2]) / 2;
}

/* The tetrahedron of a triangle, or the triangle itself. */
static void add_triangle(moments *m, kmp_mesh_matter matter, double corner[3][3])
{
    const double *a = corner[0], *b = corner[1], *c = corner[2];
    bool thin = matter == KMP_MESH_SURFACE;
    double v = thin ? area_of(a, b, c) : tetrahedron(a, b, c), sum[3];
    v = matter == KMP_MESH_PYRAMIDS ? fabs(v) : v;
    m->volume += v;
    for (int i = 0; i < 3; i++) {
        sum[i] = a[i] + b[i] + c[i];
        m->first[i] += v / (thin ? 3 : 4) * sum[i];
    }
    for (int k = 0; k < 6; k++) {
        int i = row[k], j = column[k];
        m->second[k] += v / (thin ? 12 : 20) * (sum[i] * sum[j] + a[i] * a[j] + b[i] * b[j] + c[i] * c[j]);
    }
}

static moments integrate(const kmp_mesh *mesh, kmp_mesh_matter matter, const double origin[3])
{
    moments m = {.volume = 0};
    for (int k = 0; k < mesh->triangle_count; k++) {
        double corner[3][3];
        for (int i = 0; i < 9; i++)
            corner[i / 3][i % 3] = mesh->vertex[mesh->triangle[k][i / 3]][i % 3] - origin[i % 3];
        add_triangle(&m, matter, corner);
    }
    return m;
}

static void put_inertia(const double second[6], double inertia[6])
{
    for (int k = 0; k < 6; k++)
        inertia[k] = k < 3 ? second[(k + 1) % 3] + second[(k + 2) % 3] : -second[k];
}

bool kmp_mesh_weigh(const kmp_mesh *mesh, kmp_mesh_matter matter, kmp_mesh_volume *volume, kmp_text *why)
{
    double low[3], high[3], centre[3];
    if (matter == KMP_MESH_SOLID)
        return kmp_mesh_enclose(mesh, volume, why);
    kmp_mesh_box(mesh, low, high);
    memcpy(centre, low, sizeof centre);
    for (int pass = KMP_MESH_SURFACE; pass <= (int)matter; pass++) { /* of the surface, then of its pyramids */
        moments m = integrate(mesh, (kmp_mesh_matter)pass, centre);
        if (!(m.volume > 0) || !isfinite(m.volume)) {
            kmp_text_put(why, "the mesh has no extent");
            return false;
        }
        for (int i = 0; i < 3; i++)
            centre[i] += m.first[i] / m.volume;
    }
    moments m = integrate(mesh, matter, centre);
    *volume = (kmp_mesh_volume){.volume = m.volume};
    memcpy(volume->centre, centre, sizeof centre);
    put_inertia(m.second, volume->inertia);
    return true;
}

bool kmp_mesh_enclose(const kmp_mesh *mesh, kmp_mesh_volume *volume, kmp_text *why)
{
    double low[3], high[3], origin[3], d[3], central[6];
    if (!is_closed(mesh, why))
        return false;
    kmp_mesh_box(mesh, low, high);
    for (int i = 0; i < 3; i++) /* near the mesh, so that a distant origin costs no digits */
        origin[i] = low[i] + (high[i] - low[i]) / 2;
    moments m = integrate(mesh, KMP_MESH_SOLID, origin);
    double sign = m.volume < 0 ? -1 : 1;
    if (m.volume == 0 || !isfinite(m.volume)) {
        kmp_text_put(why, "the mesh encloses no volume");
        return false;
    }
    *volume = (kmp_mesh_volume){.volume = sign * m.volume, .inward = sign < 0};
    for (int i = 0; i < 3; i++) {
        d[i] = m.first[i] / m.volume;
        volume->centre[i] = origin[i] + d[i];
    }
    for (int k = 0; k < 6; k++)
        central[k] = sign * (m.second[k] - m.volume * d[row[k]] * d[column[k]]);
    put_inertia(central, volume->inertia);
    return true;
}
