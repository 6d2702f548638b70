/* SPDX-License-Identifier: BSD-3-Clause */
/* Wavefront OBJ: vertices and faces. Texture coordinates, normals, groups and materials are left out; polygons are
 * divided into triangles from their first corner. */
#include "model/data/mesh_obj.h"
#include "base/memory.h"
#include "model/data/mesh.h"
#include <stdlib.h>
#include <string.h>

typedef struct obj {
    kmp_mesh_maker *m;
    kmp_token_reader words;
    int *vertex; /* of the mesh, by its number in the file */
    int count;
    kmp_text *why;
} obj;

static bool read_vertex(obj *o)
{
    double at[3];
    int *grown = kmp_list_room(o->vertex, (size_t)o->count, sizeof *grown);
    o->why->failed = o->why->failed || !grown;
    if (!grown)
        return false;
    o->vertex = grown;
    for (int k = 0; k < 3; k++)
        if (!kmp_token_number(&o->words, false, &at[k], o->why))
            return false;
    o->vertex[o->count] = kmp_mesh_vertex(o->m, at);
    return o->vertex[o->count++] >= 0;
}

/* The vertex of a corner "3", "3/1", "3//2", "-1": from 1 on, negative ones back from the last. */
static bool read_corner(obj *o, const char *word, size_t length, int *vertex)
{
    char *end;
    long k = strtol(word, &end, 10);
    bool ended = end > word && (end == word + length || *end == '/');
    long index = k > 0 ? k - 1 : o->count + k;
    if (ended && k != 0 && index >= 0 && index < o->count) {
        *vertex = o->vertex[index];
        return true;
    }
    kmp_text_printf(o->why, "line %d: '%.*s' is no vertex of the %d before it", o->words.line,
                    length > 40 ? 40 : (int)length, word, o->count);
    return false;
}

static bool read_face(obj *o)
{
    const char *word;
    size_t length;
    int corner = 0, first = -1, last = -1, next;
    while ((length = kmp_token_next(&o->words, false, &word)) > 0 && *word != '#') {
        if (!read_corner(o, word, length, &next))
            return false;
        if (corner >= 2 && !kmp_mesh_triangle(o->m, first, last, next))
            return false;
        first = corner == 0 ? next : first;
        last = next;
        corner++;
    }
    if (corner < 3)
        kmp_text_printf(o->why, "line %d: a face has three corners or more, not %d", o->words.line, corner);
    return corner >= 3;
}

bool kmp_obj_read(kmp_mesh_maker *m, const char *text, size_t length, kmp_text *why)
{
    obj o = {.m = m, .words = {text, 1}, .why = why};
    bool good = strlen(text) == length;
    if (!good)
        kmp_text_put(why, "it is no text");
    while (good && *o.words.s) {
        const char *word;
        size_t size = kmp_token_next(&o.words, false, &word);
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
