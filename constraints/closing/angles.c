/* SPDX-License-Identifier: BSD-3-Clause */
#include "constraints/closing/angles.h"
#include "constraints/tolerances.h"
#include "linalg/dot.h"
#include <math.h>

/* a.(b x R c), where R turns about b by an angle. With the components of a and c across b it is A cos + B sin, A = a.(b
 * x c), B = a.(b x (b x c)). */
static bool is_singular(const double a[3], const double b[3], const double c[3], double angle)
{
    double bc[3], bbc[3];
    kmp_cross3(b, c, bc);
    kmp_cross3(b, bc, bbc);
    double cosine = kmp_dot3(a, bc), sine = kmp_dot3(a, bbc), most = hypot(cosine, sine);
    return fabs(cosine * cos(angle) + sine * sin(angle)) < KMP_AXES_WEAK * most;
}

/* The middle one of three rotations of a joint that are singular at q, or nearly; -1: none. */
static int find_singular(const kempe_model *model, const double *q)
{
    for (int k = 1; k + 1 < model->motion_count; k++) {
        const kmp_motion *m = &model->motions[k];
        bool three = m[-1].rotation && m->rotation && m[1].rotation;
        if (three && m[-1].body == m->body && m->body == m[1].body && is_singular(m[-1].axis, m->axis, m[1].axis, q[k]))
            return k;
    }
    return -1;
}

void kmp_angles_explain(const kempe_model *model, const double *q, kmp_text *text)
{
    int k = find_singular(model, q);
    if (k >= 0)
        kmp_text_printf(text,
                        "; joint '%s' reaches the singular position of its angles, %s = %.6g: choose another axis or "
                        "another order of its rotations, or use none of its angles",
                        model->bodies[model->motions[k].body].joint, model->motions[k].name, q[k]);
}
