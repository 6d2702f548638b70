/*
 * Equations of 'slider-crank with a loose pin', written by Kempe 0.1.0
 * model 0dbee86580304fc8, M by scheme composite, numbers folded
 *
 * M qdd + C = J' lambda, Q = M qdd + C, h = 0, J = dh/dq, J qdd + jdqd = 0; SI units
 * operations (+ - * /; with signs and functions; of these for the parameters):
 *   M_C: 87; 106; 0
 *   invdyn: 97; 116; 0
 *   h_J: 0; 0; 0
 *   jdqd: 0; 0; 0
 *
 * q: 0 A (rad) 1 B (rad) 2 S (m) 3 pin.impact (integral of the state qd)
 */
#ifndef KEMPE_slider_crank_with_a_loose_pin_H
#define KEMPE_slider_crank_with_a_loose_pin_H

#ifdef __cplusplus
extern "C" {
#endif

enum { slider_crank_with_a_loose_pin_coordinates = 4, slider_crank_with_a_loose_pin_rows = 0, slider_crank_with_a_loose_pin_parameters = 0, slider_crank_with_a_loose_pin_bodies = 3 };

extern const char slider_crank_with_a_loose_pin_hash[17]; /* of the model */
extern const char *const slider_crank_with_a_loose_pin_coordinate_names[];

/* Matrices row by row, whole.
 * t: s; q, qd: 4
 * M: 4 x 4, mass matrix
 * C: 4, M qdd + C are the efforts of the joints; forces of the model included
 */
void slider_crank_with_a_loose_pin_M_C(double t, const double *q, const double *qd, double *M, double *C);

/* Matrices row by row, whole.
 * t: s; q, qd, qdd: 4
 * Q: 4, efforts that give qdd
 */
void slider_crank_with_a_loose_pin_invdyn(double t, const double *q, const double *qd, const double *qdd, double *Q);

/* Matrices row by row, whole.
 * t: s; q: 4
 * h: 0, closures
 * J: 0 x 4, their derivatives by q
 */
void slider_crank_with_a_loose_pin_h_J(double t, const double *q, double *h, double *J);

/* Matrices row by row, whole.
 * t: s; q, qd: 4
 * jdqd: 0, their second time derivatives at qdd = 0
 */
void slider_crank_with_a_loose_pin_jdqd(double t, const double *q, const double *qd, double *jdqd);

#ifdef __cplusplus
}
#endif
#endif
