/* SPDX-License-Identifier: BSD-3-Clause */
/* A mesh is made by adding triangles; vertices at the same place are found by a hash of their bits. */
#include "model/data/mesh.h"
#include "base/arena.h"
#include "base/memory.h"
#include "base/text.h"
#include "model/language/limits.h"
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* -- a mesh in the making ---------------------------------------------------------------------------- */

/* A place in a text that is read word by word, with the number of its line. */
typedef struct token_reader {
    const char *s;
    int line;
} token_reader;

typedef struct mesh_maker {
    kmp_mesh mesh;
    int *slot; /* vertices by hash, -1: empty */
    uint32_t slots;
    bool failed; /* because memory is exhausted */
} mesh_maker;

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

/* Its slot, or the empty one that it belongs to. */
static uint32_t find(const mesh_maker *m, const double at[3])
{
    uint32_t k = hash(at) & (m->slots - 1);
    for (; m->slot[k] >= 0; k = (k + 1) & (m->slots - 1)) {
        const double *v = m->mesh.vertex[m->slot[k]];
        if (v[0] == at[0] && v[1] == at[1] && v[2] == at[2])
            break;
    }
    return k;
}

static bool grow_slots(mesh_maker *m)
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

/* Adds a triangle of three vertices, or a vertex; -1 without memory. */
static int mesh_vertex(mesh_maker *m, const double at[3])
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

static bool mesh_triangle(mesh_maker *m, int a, int b, int c)
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

/* The next word of the line (of the text with `lines`); its length, 0: there is none. */
static size_t token_next(token_reader *words, bool lines, const char **word)
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

/* Reads the next word as a finite number; false: `why` has "line 3: a number is expected, not 'x'". */
static bool token_number(token_reader *words, bool lines, double *x, kmp_text *why)
{
    const char *word;
    size_t length = token_next(words, lines, &word), sign = length > 0 && (*word == '-' || *word == '+');
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

/* -- STL --------------------------------------------------------------------------------------------- */

/* STL (3D Systems, StereoLithography Interface Specification, 1989), as text or binary: a text begins with `solid` and
 * does not have the length that its bytes 80 to 83 would mean in a binary file. */

enum { HEAD = 84, FACET = 50 };

/* -- binary ------------------------------------------------------------------------------------------ */

static uint32_t little_endian(const char *s)
{
    const unsigned char *b = (const unsigned char *)s;
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static double number_at(const char *s)
{
    uint32_t bits = little_endian(s);
    float x;
    memcpy(&x, &bits, sizeof x);
    return (double)x;
}

/* Three vertices of three numbers after the normal, which is not used. */
static bool read_facet(mesh_maker *m, const char *s, uint32_t number, kmp_text *why)
{
    int vertex[3];
    for (int k = 0; k < 3; k++) {
        double at[3];
        for (int i = 0; i < 3; i++)
            at[i] = number_at(s + 12 + 12 * k + 4 * i);
        if (!isfinite(at[0]) || !isfinite(at[1]) || !isfinite(at[2])) {
            kmp_text_printf(why, "triangle %u has a coordinate that is not finite", number + 1);
            return false;
        }
        vertex[k] = mesh_vertex(m, at);
        if (vertex[k] < 0)
            return false;
    }
    return mesh_triangle(m, vertex[0], vertex[1], vertex[2]);
}

static bool read_binary(mesh_maker *m, const char *text, size_t length, kmp_text *why)
{
    uint32_t count = length >= HEAD ? little_endian(text + 80) : 0;
    if (length < HEAD || length < HEAD + (size_t)count * FACET) {
        kmp_text_printf(
            why, "not an STL file: it does not begin with 'solid', and is too short for a binary file of %u triangle%s",
            count, count == 1 ? "" : "s");
        return false;
    }
    if (count > KMP_MOST_TRIANGLES) {
        kmp_text_printf(why, "it has %u triangles: at most %d are possible", count, KMP_MOST_TRIANGLES);
        return false;
    }
    for (uint32_t k = 0; k < count; k++)
        if (!read_facet(m, text + HEAD + (size_t)k * FACET, k, why))
            return false;
    return true;
}

/* -- text -------------------------------------------------------------------------------------------- */

static bool is_word(const char *word, size_t length, const char *wanted)
{
    return strlen(wanted) == length && strncasecmp(word, wanted, length) == 0;
}

static bool expect(token_reader *words, const char *wanted, kmp_text *why)
{
    const char *word;
    size_t length = token_next(words, true, &word);
    if (is_word(word, length, wanted))
        return true;
    if (length == 0)
        kmp_text_printf(why, "line %d: '%s' is expected, but the file ends", words->line, wanted);
    else
        kmp_text_printf(why, "line %d: '%s' is expected, not '%.*s'", words->line, wanted,
                        length > 40 ? 40 : (int)length, word);
    return false;
}

/* From the word after `facet` on. The normal may be anything: many programs write nan. */
static bool read_written_facet(mesh_maker *m, token_reader *words, kmp_text *why)
{
    int vertex[3];
    double at[3];
    const char *word;
    bool good = expect(words, "normal", why);
    for (int k = 0; k < 3; k++)
        (void)token_next(words, true, &word);
    good = good && expect(words, "outer", why) && expect(words, "loop", why);
    for (int k = 0; k < 3 && good; k++) {
        good = expect(words, "vertex", why);
        for (int i = 0; i < 3; i++)
            good = good && token_number(words, true, &at[i], why);
        vertex[k] = good ? mesh_vertex(m, at) : -1;
        good = vertex[k] >= 0;
    }
    return good && expect(words, "endloop", why) && expect(words, "endfacet", why) &&
           mesh_triangle(m, vertex[0], vertex[1], vertex[2]);
}

static bool read_written(mesh_maker *m, const char *text, kmp_text *why)
{
    token_reader words = {text, 1};
    const char *word;
    size_t length;
    bool open = false;
    while ((length = token_next(&words, true, &word)) > 0) {
        bool begins = is_word(word, length, "solid"), ends = is_word(word, length, "endsolid");
        if (begins || ends) {
            open = begins;
            words.s += strcspn(words.s, "\n"); /* its name */
        } else if (!open || !is_word(word, length, "facet")) {
            kmp_text_printf(why, "line %d: '%s' is expected, not '%.*s'", words.line, open ? "facet" : "solid",
                            length > 40 ? 40 : (int)length, word);
            return false;
        } else if (!read_written_facet(m, &words, why)) {
            return false;
        }
    }
    if (open)
        kmp_text_printf(why, "line %d: 'endsolid' is expected, but the file ends", words.line);
    return !open;
}

/* False: `why` has the reason, or no memory. */
static bool stl_read(mesh_maker *m, const char *text, size_t length, kmp_text *why)
{
    bool solid = strncasecmp(text + strspn(text, " \t\r\n"), "solid", 5) == 0;
    bool exact = length >= HEAD && length == HEAD + (size_t)little_endian(text + 80) * FACET;
    return solid && !exact ? read_written(m, text, why) : read_binary(m, text, length, why);
}

/* -- Wavefront OBJ ----------------------------------------------------------------------------------- */

/* Wavefront OBJ: vertices and faces. Texture coordinates, normals, groups and materials are left out; polygons are
 * divided into triangles from their first corner. */

typedef struct obj_reader {
    mesh_maker *m;
    token_reader words;
    int *vertex; /* of the mesh, by its number in the file */
    int count;
    kmp_text *why;
} obj_reader;

static bool read_vertex(obj_reader *o)
{
    double at[3];
    int *grown = kmp_list_room(o->vertex, (size_t)o->count, sizeof *grown);
    o->why->failed = o->why->failed || !grown;
    if (!grown)
        return false;
    o->vertex = grown;
    for (int k = 0; k < 3; k++)
        if (!token_number(&o->words, false, &at[k], o->why))
            return false;
    o->vertex[o->count] = mesh_vertex(o->m, at);
    return o->vertex[o->count++] >= 0;
}

/* The vertex of a corner "3", "3/1", "3//2", "-1": from 1 on, negative ones back from the last. */
static bool read_corner(obj_reader *o, const char *word, size_t length, int *vertex)
{
    char *end;
    long k = strtol(word, &end, 10);
    bool ended = end > word && (end == word + length || *end == '/');
    long index = k > 0 ? k - 1 : o->count + k;
    if (ended && k != 0 && index >= 0 && index < o->count) {
        *vertex = o->vertex[index];
        return true;
    }
    kmp_text_printf(o->why, "line %d: '%.*s' is not one of the %d vertices before it", o->words.line,
                    length > 40 ? 40 : (int)length, word, o->count);
    return false;
}

static bool read_face(obj_reader *o)
{
    const char *word;
    size_t length;
    int corner = 0, first = -1, last = -1, next;
    while ((length = token_next(&o->words, false, &word)) > 0 && *word != '#') {
        if (!read_corner(o, word, length, &next))
            return false;
        if (corner >= 2 && !mesh_triangle(o->m, first, last, next))
            return false;
        first = corner == 0 ? next : first;
        last = next;
        corner++;
    }
    if (corner < 3)
        kmp_text_printf(o->why, "line %d: a face has three corners or more, not %d", o->words.line, corner);
    return corner >= 3;
}

static bool obj_read(mesh_maker *m, const char *text, size_t length, kmp_text *why)
{
    obj_reader o = {.m = m, .words = {text, 1}, .why = why};
    bool good = strlen(text) == length;
    if (!good)
        kmp_text_put(why, "it is not a text file");
    while (good && *o.words.s) {
        const char *word;
        size_t size = token_next(&o.words, false, &word);
        if (size == 1 && *word == 'v')
            good = read_vertex(&o);
        else if (size == 1 && *word == 'f')
            good = read_face(&o);
        o.words.s += strcspn(o.words.s, "\n");
        o.words.line += *o.words.s == '\n';
        o.words.s += *o.words.s == '\n';
    }
    kmp_free(o.vertex);
    return good;
}

bool kmp_mesh_read(kmp_arena *arena, const char *path, const char *text, size_t length, kmp_mesh *mesh, kmp_text *why)
{
    const char *ending = strrchr(path, '.');
    bool stl = ending && strcasecmp(ending, ".stl") == 0, obj = ending && strcasecmp(ending, ".obj") == 0;
    mesh_maker m = {.mesh = {.path = path}};
    if (!stl && !obj) {
        kmp_text_put(why, "a mesh is a file .stl or .obj");
        return false;
    }
    bool good = (stl ? stl_read : obj_read)(&m, text, length, why);
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

/* -- volume, centre and inertia ---------------------------------------------------------------------- */

/* Volume, centre and inertia of a closed mesh by the divergence theorem: sums over tetrahedra from one place to each
 * triangle (Mirtich, Fast and accurate computation of polyhedral mass properties, Journal of Graphics Tools 1, 1996;
 * the moments of a tetrahedron: Tonon, Journal of Mathematics and Statistics 1, 2004). A surface is closed and faces
 * one way if as many triangles pass each edge in one direction as in the other. */

static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};

/* -- edges ------------------------------------------------------------------------------------------- */

typedef struct edge {
    int low, high;      /* vertices */
    int count, balance; /* triangles; edges from low to high less edges from high to low */
} edge;

static edge *find_edge(edge *table, uint32_t slots, int low, int high)
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
    edge *e = find_edge(table, slots, low, high);
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
            const edge *e = find_edge(table, slots, from < to ? from : to, from < to ? to : from);
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

/* Triangles that are connected by vertices. */
typedef struct piece {
    double volume, low[3], high[3];
} piece;

static int root_of(int *above, int vertex)
{
    while (above[vertex] != vertex) {
        above[vertex] = above[above[vertex]];
        vertex = above[vertex];
    }
    return vertex;
}

/* The pieces of the mesh, each at one of its vertices; all others have no volume. */
static void find_pieces(const kmp_mesh *mesh, const double origin[3], int *above, piece *pieces)
{
    for (int k = 0; k < mesh->vertex_count; k++)
        above[k] = k;
    for (int k = 0; k < mesh->triangle_count; k++)
        for (int i = 1; i < 3; i++)
            above[root_of(above, mesh->triangle[k][i])] = root_of(above, mesh->triangle[k][0]);
    for (int k = 0; k < mesh->vertex_count; k++) {
        piece *p = &pieces[root_of(above, k)];
        for (int i = 0; i < 3; i++) {
            const double x = mesh->vertex[k][i];
            p->low[i] = fmin(p->low[i], x);
            p->high[i] = fmax(p->high[i], x);
        }
    }
    for (int k = 0; k < mesh->triangle_count; k++) {
        double corner[3][3];
        for (int i = 0; i < 9; i++)
            corner[i / 3][i % 3] = mesh->vertex[mesh->triangle[k][i / 3]][i % 3] - origin[i % 3];
        pieces[root_of(above, mesh->triangle[k][0])].volume += tetrahedron(corner[0], corner[1], corner[2]);
    }
}

/* True if the box of a piece lies in the box of another one that faces the other way. */
static bool is_hollow(const piece *pieces, int count, const piece *p)
{
    for (int k = 0; k < count; k++) {
        const piece *around = &pieces[k];
        bool inside = around->volume * p->volume < 0 && fabs(around->volume) > fabs(p->volume);
        for (int i = 0; i < 3 && inside; i++)
            inside = around->low[i] <= p->low[i] && p->high[i] <= around->high[i];
        if (inside)
            return true;
    }
    return false;
}

/* Pieces that face against the whole are hollows in others: one apart from all others is turned inside out. */
static bool faces_one_way(const kmp_mesh *mesh, const double origin[3], double volume, kmp_text *why)
{
    int *above = KMP_NEW(int, mesh->vertex_count);
    piece *pieces = KMP_NEW(piece, mesh->vertex_count);
    const double least = 1e-9 * fabs(volume); /* of a piece that counts: flat ones have rounding */
    why->failed = why->failed || !above || !pieces;
    for (int k = 0; !why->failed && k < mesh->vertex_count; k++)
        pieces[k] = (piece){.low = {INFINITY, INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY, -INFINITY}};
    if (!why->failed)
        find_pieces(mesh, origin, above, pieces);
    for (int k = 0; !why->failed && why->length == 0 && k < mesh->vertex_count; k++) {
        const piece *p = &pieces[k];
        if ((volume < 0 ? -p->volume : p->volume) < -least && !is_hollow(pieces, mesh->vertex_count, p))
            kmp_text_printf(why,
                            "triangles of a part from [%.6g, %.6g, %.6g] to [%.6g, %.6g, %.6g] face the other way than "
                            "the rest: the part is inside out",
                            p->low[0], p->low[1], p->low[2], p->high[0], p->high[1], p->high[2]);
    }
    kmp_free(above);
    kmp_free(pieces);
    return !why->failed && why->length == 0;
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
    if (!faces_one_way(mesh, origin, m.volume, why))
        return false;
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
