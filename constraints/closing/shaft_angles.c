/* SPDX-License-Identifier: BSD-3-Clause */
/* Angles between the shafts of joints of constant velocity: their rows have a pole at half a turn, and real joints
 * reach about 50 degrees. */
#include "constraints/closing/shaft_angles.h"
#include "base/arena.h"
#include "base/context.h"
#include "constraints/tolerances.h"
#include "dynamics/system.h"
#include "linalg/dense/dot.h"
#include "model/data/closure_table.h"
#include "model/data/model.h"
#include "model/data/pose.h"
#include <math.h>

static const double degrees = 180 / 3.14159265358979323846;

/* The direction of the closure's axis on one side, in the ground's axes. */
static void shaft_of(const kempe_model *model, const kmp_pose *poses, const double *q, const kmp_closure *closure,
                     int side, double out[3])
{
    kmp_pose at;
    kmp_pose_of_point(model, poses, q, closure->point[side], &at);
    for (int k = 0; k < 3; k++)
        out[k] = kmp_dot3(at.r[k], closure->axis[side]);
}

/* In rad. */
static double shaft_angle(const kempe_model *model, const kmp_pose *poses, const double *q, const kmp_closure *closure)
{
    double first[3], second[3], across[3];
    shaft_of(model, poses, q, closure, 0, first);
    shaft_of(model, poses, q, closure, 1, second);
    kmp_cross3(first, second, across);
    return atan2(sqrt(kmp_dot3(across, across)), kmp_dot3(first, second));
}

/* Complains of folded shafts, or warns of large angles. */
static kempe_status look(const kempe_system *s, const double *q, bool warns)
{
    const kempe_model *model = s->model;
    kmp_arena room = {0};
    kmp_pose *poses = NULL;
    kempe_status status = KEMPE_OK;
    for (int c = 0; c < model->closure_count; c++) {
        const kmp_closure *closure = &model->closures[c];
        if (kmp_closure_row_of(closure)->needs != KMP_NEEDS_SHAFTS)
            continue;
        if (!poses) {
            poses = KMP_ARENA_NEW(&room, kmp_pose, model->body_count);
            if (!poses)
                break;
            kmp_pose_all(model, q, poses);
        }
        const double angle = degrees * shaft_angle(model, poses, q, closure);
        if (!warns && angle > KMP_SHAFTS_FOLDED)
            status = kmp_complain(
                s->context, model->source.files[closure->place.file], closure->place.line, closure->place.column,
                "joint of constant velocity '%s': its shafts are folded onto each other at %.6g deg, and "
                "transmit no moment; turn the axes of one point, or start elsewhere",
                closure->name, angle);
        if (warns && angle > KMP_SHAFTS_BENT)
            kmp_log(
                s->context, KEMPE_LOG_WARNING,
                "joint of constant velocity '%s': its shafts are at %.4g deg, more than the %.0f deg that such joints "
                "reach; check its axes",
                closure->name, angle, KMP_SHAFTS_BENT);
    }
    status = room.failed ? kmp_fail_memory(s->context) : status;
    kmp_arena_free(&room);
    return status == KEMPE_OK || status == KEMPE_E_MEMORY ? status : KEMPE_E_FAILED;
}

kempe_status kmp_shafts_refuse(const kempe_system *system, const double *q)
{
    return look(system, q, false);
}

kempe_status kmp_shafts_warn(const kempe_system *system, const double *q)
{
    return look(system, q, true);
}
