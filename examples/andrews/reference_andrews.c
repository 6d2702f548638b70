// SPDX-License-Identifier: BSD-3-Clause
// Andrews' squeezing mechanism in 113-bit arithmetic, by the equations of the Test Set for IVP Solvers (problem
// "andrews") with accelerations and multipliers from one linear system, or by Kane's equations from the geometry
// (../references/kane.h).
//
//     reference_andrews > reference.csv
//
// `reference_andrews 1e-20 kane` takes the second way, to the same 17 digits; `reference_andrews 1e-20 published 80`
// has 80 rows in each 0.01 s (bench/before_after).
#include "../references/kane.h"

enum { ANGLES = 7, ROWS = 6 };

static const quad RR = 0.007Q, RA = 0.00092Q, D = 0.028Q, DA = 0.0115Q, E = 0.02Q, EA = 0.01421Q, ZF = 0.02Q,
                  FA = 0.01421Q, ZT = 0.04Q, U = 0.04Q, SA = 0.01874Q, SB = 0.01043Q, SC = 0.018Q, SD = 0.02Q,
                  SS = 0.035Q, TA = 0.02308Q, TB = 0.00916Q, UA = 0.01228Q, UB = 0.00449Q, C0 = 4530, FREE = 0.07785Q,
                  MOTOR = 0.033Q;
static const quad XA = -0.06934Q, YA = -0.00227Q, XB = -0.03635Q, YB = 0.03273Q, XC = 0.014Q, YC = 0.072Q;
static const quad MASS[] = {0.04325Q, 0.00365Q, 0.02373Q, 0.00706Q, 0.07050Q, 0.00706Q, 0.05498Q},
                  INERTIA[] = {2.194e-6Q, 4.410e-7Q, 5.255e-6Q, 5.667e-7Q, 1.169e-5Q, 5.667e-7Q, 1.912e-5Q};

// Upper half of the symmetric mass matrix, right-hand side; angles beta, theta, gamma, Phi, delta, Omega, epsilon.
static void published(const quad *p, const quad *v, quad m[7][7], quad *f)
{
    const quad *k = MASS, *i = INERTIA, rest = E - EA, other = ZF - FA;
    m[0][0] = k[0] * RA * RA + k[1] * (RR * RR - 2 * DA * RR * cosq(p[1]) + DA * DA) + i[0] + i[1];
    m[0][1] = k[1] * (DA * DA - DA * RR * cosq(p[1])) + i[1];
    m[1][1] = k[1] * DA * DA + i[1];
    m[2][2] = k[2] * (SA * SA + SB * SB) + i[2];
    m[3][3] = k[3] * rest * rest + i[3];
    m[3][4] = k[3] * (rest * rest + ZT * rest * sinq(p[3])) + i[3];
    m[4][4] = k[3] * (ZT * ZT + 2 * ZT * rest * sinq(p[3]) + rest * rest) + k[4] * (TA * TA + TB * TB) + i[3] + i[4];
    m[5][5] = k[5] * other * other + i[5];
    m[5][6] = k[5] * (other * other - U * other * sinq(p[5])) + i[5];
    m[6][6] = k[5] * (other * other - 2 * U * other * sinq(p[5]) + U * U) + k[6] * (UA * UA + UB * UB) + i[5] + i[6];
    quad x = SD * cosq(p[2]) + SC * sinq(p[2]) + XB - XC, y = SD * sinq(p[2]) - SC * cosq(p[2]) + YB - YC;
    quad length = sqrtq(x * x + y * y), force = -C0 * (length - FREE) / length;
    f[0] = MOTOR - k[1] * DA * RR * v[1] * (v[1] + 2 * v[0]) * sinq(p[1]);
    f[1] = k[1] * DA * RR * v[0] * v[0] * sinq(p[1]);
    f[2] = force * (x * (SC * cosq(p[2]) - SD * sinq(p[2])) + y * (SD * cosq(p[2]) + SC * sinq(p[2])));
    f[3] = k[3] * ZT * rest * v[4] * v[4] * cosq(p[3]);
    f[4] = -k[3] * ZT * rest * v[3] * (v[3] + 2 * v[4]) * cosq(p[3]);
    f[5] = -k[5] * U * other * v[6] * v[6] * cosq(p[5]);
    f[6] = k[5] * U * other * v[5] * (v[5] + 2 * v[6]) * cosq(p[5]);
}

// Adds length (cos, sin) of a sum of angles to two rows of g: to their Jacobian, to what the rates leave at the
// accelerations.
static void arm(quad g[ROWS][ANGLES], quad *bias, int row, quad length, quad turned, const int *which, const quad *p,
                const quad *v)
{
    quad angle = turned, rate = 0;
    for (int k = 0; k < 2 && which[k] >= 0; k++) {
        angle += p[which[k]];
        rate += v[which[k]];
    }
    for (int k = 0; k < 2 && which[k] >= 0; k++) {
        g[row][which[k]] -= length * sinq(angle);
        g[row + 1][which[k]] += length * cosq(angle);
    }
    bias[row] -= length * cosq(angle) * rate * rate;
    bias[row + 1] -= length * sinq(angle) * rate * rate;
}

// The six published rows: E of K2 less E of K3, of K4 by K5, of K6 by K7.
static void closures(const quad *p, const quad *v, quad g[ROWS][ANGLES], quad *bias)
{
    const int crank[] = {0, -1}, rod[] = {0, 1}, plate[] = {2, -1}, k4[] = {3, 4}, k5[] = {4, -1}, k6[] = {5, 6},
              k7[] = {6, -1};
    for (int row = 0; row < ROWS; row += 2) {
        arm(g, bias, row, RR, 0, crank, p, v);
        arm(g, bias, row, -D, 0, rod, p, v);
    }
    arm(g, bias, 0, -SS, -M_PI_2q, plate, p, v);
    arm(g, bias, 2, -E, -M_PI_2q, k4, p, v);
    arm(g, bias, 2, -ZT, 0, k5, p, v);
    arm(g, bias, 4, -ZF, 0, k6, p, v);
    arm(g, bias, 4, -U, -M_PI_2q, k7, p, v);
}

// Accelerations and multipliers: M a + G' lambda = f, G a = -bias.
static void by_test_set(const quad *p, const quad *v, quad *out)
{
    enum { SIZE = ANGLES + ROWS };
    quad m[7][7] = {{0}}, g[ROWS][ANGLES] = {{0}}, bias[ROWS] = {0}, a[SIZE * SIZE] = {0};
    published(p, v, m, out);
    closures(p, v, g, bias);
    for (int i = 0; i < ANGLES; i++) {
        for (int j = 0; j < ANGLES; j++)
            a[i * SIZE + j] = i < j ? m[i][j] : m[j][i];
        for (int r = 0; r < ROWS; r++)
            a[i * SIZE + ANGLES + r] = a[(ANGLES + r) * SIZE + i] = g[r][i];
    }
    for (int r = 0; r < ROWS; r++)
        out[ANGLES + r] = -bias[r];
    solve(SIZE, a, out);
}

// The bodies of andrews.yaml in the order of the angles: K1, K2, K3, K4, K5, K6, K7.
static void move(quad t, const quad *q, const quad *qd, const quad *qdd, motion *m)
{
    (void)t;
    const vec axis = {0, 0, 1},
              centre[] = {{0.00092Q, 0, 0},        {-0.0115Q, 0, 0}, {0.01043Q, -0.01874Q, 0}, {0, -0.00579Q, 0},
                          {0.02308Q, 0.00916Q, 0}, {0.00579Q, 0, 0}, {-0.00449Q, -0.01228Q, 0}};
    const int order[] = {0, 1, 2, 4, 3, 6, 5}, parent[] = {-1, 0, -1, 4, -1, 6, -1};
    const vec place[] = {{0, 0, 0},   {0.007Q, 0, 0},  {XB, YB, 0}, {0.040Q, 0, 0},
                         {XA, YA, 0}, {0, -0.040Q, 0}, {XA, YA, 0}};
    frame f[7];
    for (int i = 0; i < 7; i++) {
        int k = order[i];
        f[k] = turn(at(parent[k] < 0 ? ground() : f[parent[k]], place[k]), axis, q[k], qd[k], qdd[k]);
        m->bodies[k] = (body){.frame = at(f[k], centre[k]), .mass = MASS[k], .inertia = {0, 0, INERTIA[k]}};
    }
    frame e = at(f[1], (vec){-0.028Q, 0, 0}), e3 = at(f[2], (vec){0, -0.035Q, 0}), e4 = at(f[3], (vec){0, -0.020Q, 0}),
          e6 = at(f[5], (vec){0.020Q, 0, 0});
    close_at(m, &e3, &e, 0, 1);
    close_at(m, &e4, &e, 0, 1);
    close_at(m, &e6, &e, 0, 1);
}

static void load(quad t, const quad *q, const quad *qd, motion *m, quad *torques)
{
    (void)t, (void)q, (void)qd;
    frame d = at(m->bodies[2].frame, (vec){0.020Q - 0.01043Q, -0.018Q + 0.01874Q, 0}),
          c = at(ground(), (vec){XC, YC, 0});
    spring(&m->bodies[2], &d, NULL, &c, C0, 0, FREE);
    torques[0] = MOTOR;
}

static const mechanism SYSTEM = {.n = ANGLES, .bodies = 7, .rows = ROWS, .move = move, .load = load};
static int kane;

static void solved(const quad *q, const quad *qd, quad *out)
{
    if (kane)
        accelerations(&SYSTEM, 0, q, qd, out);
    else
        by_test_set(q, qd, out);
}

static void rates(quad t, const quad *state, quad *rate)
{
    (void)t;
    quad out[ANGLES + ROWS];
    solved(state, state + ANGLES, out);
    memcpy(rate, state + ANGLES, ANGLES * sizeof *rate);
    memcpy(rate + ANGLES, out, ANGLES * sizeof *rate);
}

int main(int argc, char **argv)
{
    const char *names[] = {"beta", "theta", "gamma", "Phi", "delta", "Omega", "epsilon"};
    const quad start[] = {-0.0617138900142764496358948458001Q, 0,
                          0.455279819163070380255912382449Q,   0.222668390165885884674473185609Q,
                          0.487364979543842550225598953530Q,   -0.222668390165885884674473185609Q,
                          1.23054744454982119249735015568Q};
    int parts = argc > 3 ? atoi(argv[3]) : 1;
    quad h = 1e-4Q, state[2 * ANGLES] = {0};
    kane = argc > 2 && strcmp(argv[2], "kane") == 0;
    memcpy(state, start, sizeof start);
    printf("# Initial state of the Test Set for IVP Solvers; its equations in 113-bit arithmetic, by "
           "reference_andrews.c.\nt");
    for (int k = 0; k < 2 * ANGLES; k++)
        printf(",%s.%s", k < ANGLES ? "q" : "qd", names[k % ANGLES]);
    printf(",lambda.E3.1,lambda.E3.2,lambda.E4.1,lambda.E4.2,lambda.E6.1,lambda.E6.2\n");
    for (int k = 0; k <= 5 * parts; k++) {
        if (k > 0)
            integrate(rates, 0.01Q * (k - 1) / parts, 0.01Q * k / parts, tolerance(argc, argv), &h, 2 * ANGLES, state);
        quad values[2 * ANGLES + ROWS], out[ANGLES + ROWS];
        solved(state, state + ANGLES, out);
        memcpy(values, state, sizeof state);
        memcpy(values + 2 * ANGLES, out + ANGLES, ROWS * sizeof *out);
        row(0.01Q * k / parts, 2 * ANGLES + ROWS, values, 20);
    }
    return 0;
}
