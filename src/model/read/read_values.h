/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers, vectors and the names that refer to bodies, points and motions. */
#pragma once

#include "model/read/reading.h"

/** An expression of parameters, finite, of this dimension if its own is known. */
bool kmp_read_number(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, kmp_number *number);

/** Warns of angles without a unit of more than a turn, where other numbers of the model are in degrees. */
void kmp_warn_of_turns(kmp_reader *r);

/** True for a number without a unit, or a parameter whose value is one. */
bool kmp_is_bare(kmp_reader *r, const kmp_yaml *node);

bool kmp_read_vector(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, kmp_number vector[3]);

/** Three numbers: a list of them, or one for all. */
bool kmp_read_one_or_three(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                           kmp_number numbers[3]);

/** A number outside the equations: its parameters cannot vary (kmp_reader_fix). */
bool kmp_read_fixed(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, double *value);

/** A number outside the equations that is in a given unit if it names none: `si` of it are one in SI. */
bool kmp_read_quantity(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, double si,
                       double *value);

/** Reports a number that is not positive or, for NOT_NEGATIVE, negative; `hint` ends the sentence. */
bool kmp_check_rule(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_field_rule rule, double value,
                    const char *hint);

/** A number that a rule holds for, of the equations or outside them. */
bool kmp_read_ruled(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted, kmp_field_rule rule,
                    kmp_number *number);
bool kmp_read_fixed_ruled(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                          kmp_field_rule rule, double *value);

/** A whole number in a range, whose end may be infinite; `verb`: is, are. */
bool kmp_read_whole(kmp_reader *r, const kmp_yaml *node, const char *what, const char *verb, int least, double most,
                    double *value);

/** "the KEY of WHAT" as an expression; NULL without the key, which is an error where it is required, and after one. */
const kmp_expr *kmp_read_ruled_key(kmp_reader *r, const kmp_yaml *map, const char *what, const char *key, bool required,
                                   kmp_dimension wanted, kmp_field_rule rule);

/** Notes that something of the model depends on the parameters in an expression (NULL: on none). */
void kmp_reader_use(kmp_reader *r, const kmp_expr *expr);

/** Marks parameters in the expression of a number as fixed: they determine a setting of runs, or a value that shapes
 * the equations. */
void kmp_reader_fix_setting(kmp_reader *r, const kmp_number *number);
void kmp_reader_fix(kmp_reader *r, const kmp_number *number);

/** The expression of a parameter, over others; not valued, and without marking them as used. NULL after an error. */
const kmp_expr *kmp_read_constant(kmp_reader *r, const kmp_yaml *node, const char *what);
kmp_number kmp_number_of(const kmp_expr *expr, double value);

/** Reports a value that is not finite. */
bool kmp_check_finite(kmp_reader *r, const kmp_yaml *node, const char *what, double value);

/** Reports an expression whose dimensions do not fit each other, or whose own is known and not the required one. */
bool kmp_check_dimension(kmp_reader *r, const kmp_yaml *node, const char *what, const kmp_expr *expr,
                         kmp_dimension wanted, kmp_dimension *dimension);

/** NULL after an error. */
const kmp_expr *kmp_read_expr(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                              kmp_operands allowed);

/** An expression of parameters and t; NULL after an error. `*first`: its value at t = 0. */
const kmp_expr *kmp_read_function(kmp_reader *r, const kmp_yaml *node, const char *what, kmp_dimension wanted,
                                  double *first);

/** A point of the model, or an axis of it (-1: the point itself), for measures; false: no memory. */
bool kmp_reader_measure_argument(kmp_reader *r, int point, int axis, kmp_measure_argument *argument);

/** The dimension of a coordinate, times s^power: the place of its rate with -1. */
kmp_dimension kmp_motion_dimension(const kempe_model *model, int motion, double power);

/** The dimension of the effort on a motion: N m or N. */
kmp_dimension kmp_effort_dimension(const kempe_model *model, int motion);

int kmp_read_body(kmp_reader *r, const kmp_yaml *node, const char *what);
int kmp_read_point(kmp_reader *r, const kmp_yaml *node, const char *what); /* BODY.POINT */
int kmp_read_point_text(kmp_reader *r, kmp_place place, const char *text, const char *what);
int kmp_read_point_of(kmp_reader *r, kmp_place place, int body, const char *name, const char *what); /* POINT */
bool kmp_read_two_points(kmp_reader *r, const kmp_yaml *node, const char *what, int point[2]);
int kmp_read_motion(kmp_reader *r, const kmp_yaml *node, const char *what); /* JOINT or JOINT.K */
int kmp_read_motion_text(kmp_reader *r, kmp_place place, const char *name, const char *what);

/** A unit vector: x, -y, ..., or a list of three numbers. */
bool kmp_read_axis(kmp_reader *r, const kmp_yaml *node, const char *what, double axis[3]);

/** An orientation {x: axis, z: axis}: the first axis is used as given, the second is orthogonalised. From a single axis
 * the others follow (kmp_complete_axes). The columns of m are the three axes. */
bool kmp_read_axes(kmp_reader *r, const kmp_yaml *node, const char *what, double m[3][3]);

/** Right-handed axes whose k-th is `axis`, by the shortest rotation from unit vector k. For the axis opposite to k it
 * is half a turn about the one that follows k. */
void kmp_complete_axes(int k, const double axis[3], double m[3][3]);

/** Right-handed axes whose k-th is `first` and whose l-th is in the plane with `second`; false when the two are
 * parallel. */
bool kmp_square_axes(int k, const double first[3], int l, const double second[3], double m[3][3]);
