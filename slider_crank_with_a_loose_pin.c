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
 *
 * To compile: cc -std=c99 -O2 -ffp-contract=off -c slider_crank_with_a_loose_pin.c (kempe_runtime.h beside it, libm to link). With
 * contraction, or with -ffast-math, the results differ from those of Kempe by rounding.
 */
#include "slider_crank_with_a_loose_pin.h"
#include "kempe_runtime.h"

const char slider_crank_with_a_loose_pin_hash[17] = "0dbee86580304fc8";
const char *const slider_crank_with_a_loose_pin_coordinate_names[] = {
    "A", "B", "S", "pin.impact"};

static double slider_crank_with_a_loose_pin_abs(double x)
{
    return fabs(x);
}

static double slider_crank_with_a_loose_pin_less(double x, double y)
{
    return x < y ? 1 : 0;
}

static double slider_crank_with_a_loose_pin_select(double x, double y, double z)
{
    return x != 0 ? y : z;
}

void slider_crank_with_a_loose_pin_M_C(double t, const double *q, const double *qd, double *M, double *C)
{
    (void)t;
    memset(M, 0, 16 * sizeof(double));
    memset(C, 0, 4 * sizeof(double));
    double S2, C2;
    kempe_sincos(q[1], &S2, &C2);
    double S1, C1;
    kempe_sincos(q[0], &S1, &C1);
    const double a1 = 0.05*C1;
    const double a2 = 0.05*S1;
    /* link 2, angular velocity, (11) */
    const double OM32 = qd[0] + qd[1];
    /* link 1, moment of the joint per qdd, (36) of motion 2 */
    M[4] = M[1] = 0.001006 + 0.0006299999999999999*C2;
    /* link 1, inertia of what the joint carries about its origin */
    M[0] = 0.001631 + 0.0012599999999999998*C2;
    /* link 2, moment of the joint, (27) */
    const double CF32 = 0.0006299999999999999*(S2*(qd[0]*qd[0]));
    const double a3 = 0.12*(S2*S1 - C2*C1);
    const double a4 = 0.12*(S2*C1 + C2*S1);
    const double a5 = a1 - a3;
    const double a6 = a2 + a4;
    const double a7 = q[2] - a5;
    const double a8 = qd[2] + (qd[0]*a2 + OM32*a4);
    const double a9 = qd[0]*a1 - OM32*a3;
    const double a10 = a6*a6;
    const double a11 = a10 + a7*a7;
    const double a12 = sqrt(a11);
    const double a13 = 0.0095*OM32 + (a6*a8 - a7*a9)/a12;
    const double a14 = slider_crank_with_a_loose_pin_less(1000.0*(2.5e-07 - a11), 0.0);
    const double a15 = slider_crank_with_a_loose_pin_abs(0.0005 - a12);
    const double a16 = 1.0 + 0.14249999999999996*((a6*a9 + a7*a8)/a12)/qd[3];
    const double a17 = 66101983978.968445*(a15*sqrt(a15))*a16;
    const double a18 = slider_crank_with_a_loose_pin_select(a14, slider_crank_with_a_loose_pin_select(slider_crank_with_a_loose_pin_less(slider_crank_with_a_loose_pin_select(a14, a17, 1.0), 0.0), 0.0, a17), 0.0);
    const double a19 = a13*(0.1*a18/sqrt(0.0001 + a13*a13));
    const double a20 = a18*((a4*a7 - a3*a6)/a12) + a19*(0.0095 + (a3*a7 + a4*a6)/a12);
    const double a21 = slider_crank_with_a_loose_pin_select(a14, -(a18*(a7/a12) + a19*(a6/a12)), 0.0);
    C[2] = -a21;
    C[1] = CF32 - slider_crank_with_a_loose_pin_select(a14, -a20, 0.0);
    const double a22 = a19*(0.0095 + (a10 - a5*a7)/a12) + a18*(q[2]*a6/a12);
    const double a23 = 0.0006299999999999999*(S2*(OM32*OM32)) - (CF32 - slider_crank_with_a_loose_pin_select(a14, -a22, 0.0));
    C[0] = -a23;
    M[5] = 0.001006;
    M[10] = 0.14;
    M[15] = 1.0;
}

void slider_crank_with_a_loose_pin_invdyn(double t, const double *q, const double *qd, const double *qdd, double *Q)
{
    (void)t;
    double S2, C2;
    kempe_sincos(q[1], &S2, &C2);
    const double a1 = 0.012599999999999998*C2;
    const double a2 = 0.012599999999999998*S2;
    double S1, C1;
    kempe_sincos(q[0], &S1, &C1);
    const double a3 = 0.05*C1;
    const double a4 = 0.05*S1;
    /* link 2, angular velocity, (11) */
    const double OM32 = qd[0] + qd[1];
    /* link 2, angular acceleration, (12) */
    const double OMp32 = qdd[0] + qdd[1];
    /* link 2, moment of the joint, (27) */
    const double CF32 = 0.001006*OMp32 + (a2*(0.05*(qd[0]*qd[0])) + a1*(0.05*qdd[0]));
    /* link 1, moment of the joint, (27) */
    const double CF31 = 0.0006250000000000001*qdd[0] + (CF32 + 0.05*(a1*OMp32 - a2*(OM32*OM32)));
    const double a5 = 0.12*(S2*S1 - C2*C1);
    const double a6 = 0.12*(S2*C1 + C2*S1);
    const double a7 = a3 - a5;
    const double a8 = a4 + a6;
    const double a9 = q[2] - a7;
    const double a10 = qd[2] + (qd[0]*a4 + OM32*a6);
    const double a11 = qd[0]*a3 - OM32*a5;
    const double a12 = a8*a8;
    const double a13 = a12 + a9*a9;
    const double a14 = sqrt(a13);
    const double a15 = 0.0095*OM32 + (a8*a10 - a9*a11)/a14;
    const double a16 = slider_crank_with_a_loose_pin_less(1000.0*(2.5e-07 - a13), 0.0);
    const double a17 = slider_crank_with_a_loose_pin_abs(0.0005 - a14);
    const double a18 = 1.0 + 0.14249999999999996*((a8*a11 + a9*a10)/a14)/qd[3];
    const double a19 = 66101983978.968445*(a17*sqrt(a17))*a18;
    const double a20 = slider_crank_with_a_loose_pin_select(a16, slider_crank_with_a_loose_pin_select(slider_crank_with_a_loose_pin_less(slider_crank_with_a_loose_pin_select(a16, a19, 1.0), 0.0), 0.0, a19), 0.0);
    const double a21 = a15*(0.1*a20/sqrt(0.0001 + a15*a15));
    const double a22 = a20*((a6*a9 - a5*a8)/a14) + a21*(0.0095 + (a5*a9 + a6*a8)/a14);
    const double a23 = slider_crank_with_a_loose_pin_select(a16, -(a20*(a9/a14) + a21*(a8/a14)), 0.0);
    Q[1] = CF32 - slider_crank_with_a_loose_pin_select(a16, -a22, 0.0);
    Q[2] = 0.14*qdd[2] - a23;
    const double a24 = a21*(0.0095 + (a12 - a7*a9)/a14) + a20*(q[2]*a8/a14);
    Q[0] = CF31 - slider_crank_with_a_loose_pin_select(a16, -a24, 0.0);
    Q[3] = qdd[3];
}

void slider_crank_with_a_loose_pin_h_J(double t, const double *q, double *h, double *J)
{
    (void)h;
    (void)J;
    (void)t;
    (void)q;
}

void slider_crank_with_a_loose_pin_jdqd(double t, const double *q, const double *qd, double *jdqd)
{
    (void)jdqd;
    (void)t;
    (void)q;
    (void)qd;
}

