/* SPDX-License-Identifier: BSD-3-Clause */
/* Vertices in one cell of a grid become one (Rossignac, Borrel, Multi-resolution 3D approximations, 1993), at the place
 * with the least sum of squared distances from the planes of their triangles (Lindstrom, Out-of-core simplification of
 * large polygonal models, SIGGRAPH 2000), so that edges and flat faces are kept. The finest grid with few enough
 * triangles is found by bisection. */
#include "report/thin_mesh.h"
#include "base/memory.h"
#include <math.h>
#include <stdint.h>
#include <string.h>

enum { FINEST = 1024 };

/* A vertex stays near the mean of its cell in directions that no plane determines. */
#define TOWARDS_MEAN 1e-3

typedef struct cell {
    int count;
    double mean[3], a[6], b[3]; /* of the planes, from the mean: xx yy zz xy xz yz */
} cell;

typedef struct grid {
    const kmp_mesh *mesh;
    double low[3], side; /* of a cell */
    int *cell_of;        /* vertex */
    uint32_t slots, *key;
    int *slot;
    int cells, triangles;
} grid;

static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};

static double longest_side(const kmp_mesh *mesh, double low[3])
{
    double high[3];
    kmp_mesh_box(mesh, low, high);
    return fmax(high[0] - low[0], fmax(high[1] - low[1], high[2] - low[2]));
}

/* Numbers the cells in the order of their vertices; a key has ten bits for each direction. */
static int number_of(grid *g, uint32_t key)
{
    uint32_t k = (key * 2654435761u) & (g->slots - 1);
    while (g->slot[k] >= 0 && g->key[k] != key)
        k = (k + 1) & (g->slots - 1);
    if (g->slot[k] < 0) {
        g->slot[k] = g->cells++;
        g->key[k] = key;
    }
    return g->slot[k];
}

static bool is_kept(const grid *g, const int *t)
{
    int a = g->cell_of[t[0]], b = g->cell_of[t[1]], c = g->cell_of[t[2]];
    return a != b && b != c && c != a;
}

/* Divides the longest side into so many cells, and counts the triangles that stay. */
static void divide(grid *g, double longest, int parts)
{
    g->side = longest / parts;
    g->cells = g->triangles = 0;
    memset(g->slot, -1, g->slots * sizeof *g->slot);
    for (int k = 0; k < g->mesh->vertex_count; k++) {
        uint32_t key = 0;
        for (int i = 0; i < 3; i++) {
            double x = g->side > 0 ? (g->mesh->vertex[k][i] - g->low[i]) / g->side : 0;
            key = key << 10 | (uint32_t)fmin(x, parts - 1);
        }
        g->cell_of[k] = number_of(g, key);
    }
    for (int k = 0; k < g->mesh->triangle_count; k++)
        g->triangles += is_kept(g, g->mesh->triangle[k]);
}

/* -- vertices of cells --------------------------------------------------------------------------------- */

/* The plane of a triangle counts by the square of its area. */
static void add_plane(cell *c, const double *at, const double normal[3])
{
    double off = 0;
    for (int i = 0; i < 3; i++)
        off += normal[i] * (at[i] - c->mean[i]);
    for (int k = 0; k < 6; k++)
        c->a[k] += normal[row[k]] * normal[column[k]];
    for (int i = 0; i < 3; i++)
        c->b[i] += normal[i] * off;
}

static double determinant(const double x[3], const double y[3], const double z[3])
{
    return x[0] * (y[1] * z[2] - y[2] * z[1]) - x[1] * (y[0] * z[2] - y[2] * z[0]) + x[2] * (y[0] * z[1] - y[1] * z[0]);
}

/* Solves for the place, by Cramer's rule; far from its cell the mean is taken. */
static void settle(const grid *g, const cell *c, double at[3])
{
    double more = TOWARDS_MEAN * (c->a[0] + c->a[1] + c->a[2]) / 3, d[3], far = 0;
    double x[3] = {c->a[0] + more, c->a[3], c->a[4]}, y[3] = {c->a[3], c->a[1] + more, c->a[5]};
    double z[3] = {c->a[4], c->a[5], c->a[2] + more}, whole = determinant(x, y, z);
    d[0] = determinant(c->b, y, z) / whole;
    d[1] = determinant(x, c->b, z) / whole;
    d[2] = determinant(x, y, c->b) / whole;
    for (int i = 0; i < 3; i++)
        far = fmax(far, isfinite(d[i]) ? fabs(d[i]) : INFINITY);
    for (int i = 0; i < 3; i++)
        at[i] = c->mean[i] + (far <= g->side ? d[i] : 0);
}

static bool collect(const grid *g, kmp_arena *arena, kmp_mesh *thin)
{
    cell *cells = KMP_NEW(cell, g->cells);
    thin->vertex = kmp_arena_alloc(arena, (size_t)g->cells, sizeof *thin->vertex);
    thin->triangle = kmp_arena_alloc(arena, (size_t)g->triangles, sizeof *thin->triangle);
    thin->vertex_count = g->cells;
    thin->triangle_count = 0;
    if (cells && thin->vertex && thin->triangle) {
        for (int k = 0; k < g->mesh->vertex_count; k++) {
            cell *c = &cells[g->cell_of[k]];
            c->count++;
            for (int i = 0; i < 3; i++)
                c->mean[i] += (g->mesh->vertex[k][i] - c->mean[i]) / c->count;
        }
        for (int k = 0; k < g->mesh->triangle_count; k++) {
            const int *t = g->mesh->triangle[k];
            const double *p = g->mesh->vertex[t[0]], *q = g->mesh->vertex[t[1]], *s = g->mesh->vertex[t[2]];
            double normal[3];
            for (int i = 0; i < 3; i++) {
                int j = (i + 1) % 3, l = (i + 2) % 3;
                normal[i] = (q[j] - p[j]) * (s[l] - p[l]) - (q[l] - p[l]) * (s[j] - p[j]);
            }
            for (int i = 0; i < 3; i++)
                add_plane(&cells[g->cell_of[t[i]]], p, normal);
        }
        for (int k = 0; k < g->cells; k++)
            settle(g, &cells[k], thin->vertex[k]);
        for (int k = 0; k < g->mesh->triangle_count; k++)
            if (is_kept(g, g->mesh->triangle[k])) {
                int *to = thin->triangle[thin->triangle_count++];
                for (int i = 0; i < 3; i++)
                    to[i] = g->cell_of[g->mesh->triangle[k][i]];
            }
    }
    bool good = cells && thin->vertex && thin->triangle;
    kmp_free(cells);
    return good;
}

bool kmp_mesh_thin(kmp_arena *arena, const kmp_mesh *mesh, int most, kmp_mesh *thin)
{
    *thin = *mesh;
    if (mesh->triangle_count <= most)
        return true;
    grid g = {.mesh = mesh, .slots = 16, .cell_of = KMP_NEW(int, mesh->vertex_count)};
    while (g.slots < 2 * (uint32_t)mesh->vertex_count)
        g.slots *= 2;
    g.key = KMP_NEW(uint32_t, g.slots);
    g.slot = KMP_NEW(int, g.slots);
    bool good = g.cell_of && g.key && g.slot;
    double longest = longest_side(mesh, g.low);
    int low = 1, high = FINEST; /* low has few enough */
    while (good && high - low > 1) {
        int middle = (low + high) / 2;
        divide(&g, longest, middle);
        if (g.triangles <= most)
            low = middle;
        else
            high = middle;
    }
    if (good) {
        divide(&g, longest, low);
        good = collect(&g, arena, thin);
    }
    kmp_free(g.cell_of);
    kmp_free(g.key);
    kmp_free(g.slot);
    return good;
}
