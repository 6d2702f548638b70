/* SPDX-License-Identifier: BSD-3-Clause */
/* Meshes: STL, and OBJ where the text begins with `#` or `v`. A mesh that is read encloses a volume or is refused with
 * a reason; it is thinned. */
#include "base/arena.h"
#include "base/memory.h"
#include "base/text.h"
#include "fuzz.h"
#include "model/data/mesh.h"
#include "picture/motion_picture.h"
#include <math.h>
#include <stdbool.h>
#include <string.h>

static void check_triangles(const kmp_mesh *mesh)
{
    for (int k = 0; k < 3 * mesh->triangle_count; k++)
        fuzz_promise(mesh->triangle[k / 3][k % 3] >= 0 && mesh->triangle[k / 3][k % 3] < mesh->vertex_count,
                     "corners are vertices");
}

static void use(kmp_arena *arena, const kmp_mesh *mesh)
{
    kmp_mesh_volume v;
    kmp_mesh thin;
    kmp_text why = {0};
    bool closed = kmp_mesh_enclose(mesh, &v, &why);
    fuzz_promise(closed ? v.volume > 0 : why.length > 0, "a volume, or why there is none");
    fuzz_promise(kmp_mesh_thin(arena, mesh, 4, &thin) && thin.triangle_count <= 4, "few triangles");
    check_triangles(&thin);
    kmp_text_free(&why);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    kmp_arena arena = {0};
    kmp_mesh mesh;
    kmp_text why = {0};
    char *text = kmp_calloc(size + 1, 1);
    if (!text)
        return 0;
    memcpy(text, data, size);
    const char *path = text[0] == '#' || text[0] == 'v' ? "mesh.obj" : "mesh.stl";
    if (kmp_mesh_read(&arena, path, text, size, &mesh, &why)) {
        check_triangles(&mesh);
        use(&arena, &mesh);
    } else {
        fuzz_promise(why.length > 0, "a reason");
    }
    kmp_text_free(&why);
    kmp_arena_free(&arena);
    kmp_free(text);
    return 0;
}
