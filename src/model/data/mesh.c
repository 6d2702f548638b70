/* SPDX-License-Identifier: BSD-3-Clause */
/* A mesh is made by adding triangles; vertices at the same place are found by a hash of their bits. */
#include "model/data/mesh.h"
#include "base/memory.h"
#include "model/data/mesh_obj.h"
#include "model/data/mesh_stl.h"
#include "model/language/limits.h"
#include <math.h>
#include <stdint.h>
#include <string.h>
#include <strings.h>

struct kmp_mesh_maker {
    kmp_mesh mesh;
    int *slot; /* vertices by hash, -1: empty */
    uint32_t slots;
    bool failed; /* for want of memory */
};

/* -- vertices ---------------------------------------------------------------------------------------- */

static uint32_t hash(const double at[3])
{
    uint64_t h = 0x9e3779b97f4a7c15u, bits;
    for (int k = 0; k < 3; k++) {
        double x = at[k] + 0.0; /* no negative zero */
        memcpy(&bits, &x, sizeof bits);
        h = (h ^ bits) * 0xff51afd7ed558ccdu;
        h ^= h >> 32;
    }
    return (uint32_t)h;
}

static bool is_at(const double a[3], const double b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Its slot, or the empty one that it belongs to. */
static uint32_t find(const kmp_mesh_maker *m, const double at[3])
{
    uint32_t k = hash(at) & (m->slots - 1);
    while (m->slot[k] >= 0 && !is_at(m->mesh.vertex[m->slot[k]], at))
        k = (k + 1) & (m->slots - 1);
    return k;
}

static bool grow_slots(kmp_mesh_maker *m)
{
    uint32_t slots = m->slots ? 2 * m->slots : 1024;
    int *grown = KMP_NEW(int, slots);
    if (!grown)
        return false;
    kmp_free(m->slot);
    m->slot = grown;
    m->slots = slots;
    memset(m->slot, -1, slots * sizeof *m->slot);
    for (int k = 0; k < m->mesh.vertex_count; k++)
        m->slot[find(m, m->mesh.vertex[k])] = k;
    return true;
}

int kmp_mesh_vertex(kmp_mesh_maker *m, const double at[3])
{
    kmp_mesh *mesh = &m->mesh;
    void *list = kmp_list_room(mesh->vertex, (size_t)mesh->vertex_count, sizeof *mesh->vertex);
    mesh->vertex = list ? list : mesh->vertex;
    m->failed = m->failed || !list || (2 * (uint32_t)mesh->vertex_count >= m->slots && !grow_slots(m));
    if (m->failed)
        return -1;
    uint32_t k = find(m, at);
    if (m->slot[k] < 0) {
        m->slot[k] = mesh->vertex_count;
        memcpy(mesh->vertex[mesh->vertex_count++], at, sizeof *mesh->vertex);
    }
    return m->slot[k];
}

bool kmp_mesh_triangle(kmp_mesh_maker *m, int a, int b, int c)
{
    kmp_mesh *mesh = &m->mesh;
    if (a == b || b == c || c == a)
        return true;
    void *list = kmp_list_room(mesh->triangle, (size_t)mesh->triangle_count, sizeof *mesh->triangle);
    mesh->triangle = list ? list : mesh->triangle;
    m->failed = m->failed || !list;
    if (m->failed)
        return false;
    int *to = mesh->triangle[mesh->triangle_count++];
    to[0] = a, to[1] = b, to[2] = c;
    return true;
}

void kmp_mesh_box(const kmp_mesh *mesh, double low[3], double high[3])
{
    for (int i = 0; i < 3; i++) {
        low[i] = INFINITY;
        high[i] = -INFINITY;
        for (int k = 0; k < mesh->vertex_count; k++) {
            low[i] = fmin(low[i], mesh->vertex[k][i]);
            high[i] = fmax(high[i], mesh->vertex[k][i]);
        }
    }
}

/* -- words ------------------------------------------------------------------------------------------- */

size_t kmp_token_next(kmp_token_reader *words, bool lines, const char **word)
{
    for (;; words->s++) {
        words->s += strspn(words->s, " \t\r");
        if (*words->s != '\n' || !lines)
            break;
        words->line++;
    }
    *word = words->s;
    size_t length = strcspn(words->s, " \t\r\n");
    words->s += length;
    return length;
}

bool kmp_token_number(kmp_token_reader *words, bool lines, double *x, kmp_text *why)
{
    const char *word;
    size_t length = kmp_token_next(words, lines, &word), sign = length > 0 && (*word == '-' || *word == '+');
    size_t taken = kmp_text_to_number(word + sign, x);
    if (length == 0 || taken == 0 || taken + sign != length || !isfinite(*x)) {
        kmp_text_printf(why, "line %d: a number is expected, not '%.*s'", words->line, length > 40 ? 40 : (int)length,
                        word);
        return false;
    }
    *x = *word == '-' ? -*x : *x;
    return true;
}

/* -- files ------------------------------------------------------------------------------------------- */

/* Moves the lists to the arena. */
static bool keep(kmp_arena *arena, kmp_mesh *mesh)
{
    void *vertex = kmp_arena_alloc(arena, (size_t)mesh->vertex_count, sizeof *mesh->vertex);
    void *triangle = kmp_arena_alloc(arena, (size_t)mesh->triangle_count, sizeof *mesh->triangle);
    if (!vertex || !triangle)
        return false;
    memcpy(vertex, mesh->vertex, (size_t)mesh->vertex_count * sizeof *mesh->vertex);
    memcpy(triangle, mesh->triangle, (size_t)mesh->triangle_count * sizeof *mesh->triangle);
    mesh->vertex = vertex;
    mesh->triangle = triangle;
    return true;
}

bool kmp_mesh_read(kmp_arena *arena, const char *path, const char *text, size_t length, kmp_mesh *mesh, kmp_text *why)
{
    const char *ending = strrchr(path, '.');
    bool stl = ending && strcasecmp(ending, ".stl") == 0, obj = ending && strcasecmp(ending, ".obj") == 0;
    kmp_mesh_maker m = {.mesh = {.path = path}};
    if (!stl && !obj) {
        kmp_text_put(why, "a mesh is a file .stl or .obj");
        return false;
    }
    bool good = (stl ? kmp_stl_read : kmp_obj_read)(&m, text, length, why);
    if (good && m.mesh.triangle_count == 0)
        kmp_text_put(why, "it has no triangle");
    if (good && m.mesh.triangle_count > KMP_MOST_TRIANGLES)
        kmp_text_printf(why, "it has %d triangles: at most %d are possible", m.mesh.triangle_count, KMP_MOST_TRIANGLES);
    *mesh = m.mesh;
    good = good && why->length == 0 && !m.failed && keep(arena, mesh);
    arena->failed = arena->failed || m.failed;
    kmp_free(m.mesh.vertex);
    kmp_free(m.mesh.triangle);
    kmp_free(m.slot);
    return good;
}
