/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes of foreign models, which are pictures alone. A package of ROS is a folder: its path is not in the file, so
 * that it is looked for beside the model and in the folders around it. */
#include "exchange/formats/foreign_meshes.h"
#include "base/file.h"
#include "base/memory.h"
#include "exchange/formats/foreign_frames.h"
#include "exchange/formats/foreign_parts.h"
#include "exchange/formats/importing.h"
#include <string.h>
#include <strings.h>
#include <unistd.h>

enum { MOST_FOLDERS_UP = 8 };

/* A path relative to the model's file, if there is a file. */
static const char *try_path(const kmp_import *im, int up, const char *path)
{
    static const char ups[] = "../../../../../../../../";
    const char *slash = strrchr(im->file, '/');
    int folder = slash ? (int)(slash - im->file) + 1 : 0;
    const char *name = kmp_arena_printf(im->arena, "%.*s%s", 3 * up, ups, path);
    const char *whole = name ? kmp_arena_printf(im->arena, "%.*s%s", folder, im->file, name) : NULL;
    return whole && access(whole, R_OK) == 0 ? name : NULL;
}

/* The path of a mesh relative to the model's file; NULL: it is not found. */
static const char *find_mesh(const kmp_import *im, const char *uri)
{
    const char *scheme = strstr(uri, "://"), *path = scheme ? scheme + 3 : uri, *found = NULL;
    bool package = scheme && strncmp(uri, "file:", 5) != 0;
    const char *inside = package ? strchr(path, '/') : NULL; /* of the package */
    if (!package && path[0] == '/')
        return access(path, R_OK) == 0 ? path : NULL;
    for (int up = 0; !found && up <= (package ? MOST_FOLDERS_UP : 0); up++) {
        found = path[0] != '/' ? try_path(im, up, path) : NULL;
        if (!found && inside && inside[1])
            found = try_path(im, up, inside + 1);
    }
    return found;
}

bool kmp_import_read_mesh(kmp_import *im, const char *uri, kmp_mesh *mesh, kmp_text *why)
{
    const char *found = find_mesh(im, uri), *slash = strrchr(im->file, '/');
    int folder = slash && found && found[0] != '/' ? (int)(slash - im->file) + 1 : 0;
    const char *path = found ? kmp_arena_printf(im->arena, "%.*s%s", folder, im->file, found) : NULL;
    kempe_context *aside = path ? kempe_context_new() : NULL;
    char *text = NULL;
    size_t length;
    bool good = false;
    if (!found)
        kmp_text_printf(why, "the file '%s' is not found", uri);
    else if (!aside || kmp_file_read(aside, KMP_FILE_MESH, path, &text, &length) != KEMPE_OK)
        kmp_text_printf(why, "the file '%s' cannot be read", uri);
    else
        good = kmp_mesh_read(im->arena, path, text, length, mesh, why);
    kmp_free(text);
    kempe_context_free(aside);
    return good;
}

void kmp_import_mesh(kmp_import *im, kmp_yaml *body, kmp_place place, const char *uri, const double scale[3],
                     const kmp_pose *at, const char *colour)
{
    const char *ending = kmp_file_ending(uri), *path = NULL;
    bool known = strcasecmp(ending, ".stl") == 0 || strcasecmp(ending, ".obj") == 0;
    bool even = scale[0] == scale[1] && scale[0] == scale[2] && scale[0] > 0;
    if (known && even)
        path = find_mesh(im, uri);
    if (!path) {
        kmp_import_leave_out(im, place, KMP_PART_REMARK, "mesh", "mesh '%s' is not in the picture: %s", uri,
                             !known  ? "a mesh is a file .stl or .obj"
                             : !even ? "a mesh has one positive scale"
                                     : "it is not found beside the model or in a folder around it");
        return;
    }
    kmp_yaml *map = kmp_import_map(im, place);
    kmp_import_word(im, map, place, "mesh", path);
    if (scale[0] != 1)
        kmp_import_word(im, map, place, "scale", kmp_import_number(im, scale[0]));
    kmp_import_put(im, map, place, "at", kmp_import_numbers(im, place, 3, at->p));
    if (kmp_frame_is_turned(at))
        kmp_import_put(im, map, place, "axes", kmp_import_axes(im, place, at));
    if (colour)
        kmp_import_word(im, map, place, "colour", colour);
    kmp_yaml_append(im->arena, kmp_import_part(im, body, "shape", KMP_YAML_LIST), NULL, map);
}
