/* SPDX-License-Identifier: BSD-3-Clause */
/* The moving mechanism of a run as a file: glTF for other programs, or the data of the picture of a page. */
#include "base/file.h"
#include "picture/gltf_scene.h"
#include "picture/motion_picture.h"
#include <kempe/kempe.h>
#include <string.h>

static kempe_status write_picture(const kempe_trajectory *trajectory, const char *path)
{
    const bool locked = !kmp_is_complete(trajectory->status) && !trajectory->interrupted;
    kmp_text text = {0};
    kmp_json json = kmp_json_begin_as(&text, KMP_JSON_COMPACT);
    kmp_picture_forces arrows = {0};
    kempe_status status =
        kmp_picture_forces_of_run(&arrows, trajectory->system, &trajectory->table, trajectory->least_norm, locked);
    kmp_json_object(&json, NULL);
    kmp_motion_picture(&json, "picture", trajectory->system->model, &trajectory->table, NULL, &arrows);
    kmp_json_end(&json);
    if (status == KEMPE_OK)
        status = kmp_file_write(trajectory->system->context, path, &text);
    kmp_picture_forces_free(&arrows);
    kmp_text_free(&text);
    return status;
}

kempe_status kempe_trajectory_write_animation(const kempe_trajectory *trajectory, const char *path)
{
    KMP_WANTED(NULL, trajectory, "trajectory");
    kempe_context *context = trajectory->system->context;
    KMP_WANTED(context, path, "path");
    kmp_context_clear(context);
    const char *ending = kmp_file_ending(path);
    const bool scene = strcmp(ending, ".glb") == 0;
    if (!scene && strcmp(ending, ".json") != 0)
        return kmp_fail(
            context, KEMPE_E_ARGUMENT,
            "cannot write '%s': an animation ends with .glb, a binary file of glTF, or .json, the data of the "
            "picture",
            path);
    if (trajectory->table.rows == 0)
        return kmp_fail(context, KEMPE_E_FAILED, "the run has no rows to show");
    return scene ? kmp_gltf_write(trajectory, path) : write_picture(trajectory, path);
}
