/* SPDX-License-Identifier: BSD-3-Clause */
/* Roles of the conditions of friction that sticks and of rigid contacts. Generated simulators have this file too. */
#pragma once

/** Numbers of a friction element that sticks (dynamics/kinematics/friction_modes.h): each is a condition whose input is
 * not 1 or 0, and whose value is not a comparison. The first two are events where their values become
 * negative. */
typedef enum kmp_role {
    KMP_ROLE_NONE,
    KMP_ROLE_SENSE,        /* input: direction of slip, 1 or -1; 0: none. Value: rate in that direction */
    KMP_ROLE_HELD,         /* input: 1 while its row counts. Value: static level less the size of the friction */
    KMP_ROLE_PLACE,        /* input: where it is held; otherwise a rate that is none. Value: place */
    KMP_ROLE_GIVEN,        /* input: a force. Value: the friction */
    KMP_ROLE_RATE,         /* value: rate of the place */
    KMP_ROLE_ACCELERATION, /* value: second rate of the place */
    KMP_ROLE_LEVEL,        /* value: size of the friction in slip; of a contact: e of Newton's law */
    KMP_ROLE_STATIC,       /* value: bound of the friction in stick; of a contact: the coefficient of its friction */
    KMP_ROLE_LEVEL_BACK,   /* both against negative rates, where these levels differ from the ones above; other */
    KMP_ROLE_STATIC_BACK,  /* elements do not have these conditions */
    KMP_ROLE_END
} kmp_role;

/** The number of roles that each element has. */
enum { KMP_ROLES_OF_ALL = KMP_ROLE_LEVEL_BACK - KMP_ROLE_SENSE };

/** A given force that exceeds the static level by less than this part does not. */
#define KMP_FRICTION_SLACK 1e-9
/** A negative level of less than this part of its largest size so far is zero. */
#define KMP_LEVEL_ROUNDING 1e-9
/** The input KMP_ROLE_SENSE of an element that is regularised for a time. */
#define KMP_FRICTION_REGULARISED 2
/** The same input of a contact that a study keeps closed by the rows of others. */
#define KMP_FRICTION_CARRIES (-1)

/** Slip in two directions that begins: its input KMP_ROLE_RATE is a rate in each direction. It has begun where its rate
 * is this multiple of that one, and comes back where its rate is this part of it against its direction. */
#define KMP_FRICTION_BEGUN 100
#define KMP_FRICTION_BACK  0.1
