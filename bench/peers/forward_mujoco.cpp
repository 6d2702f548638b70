// SPDX-License-Identifier: BSD-3-Clause
// Accelerations of a tree by MuJoCo: forward_mujoco MODEL.xml FREE.xml STATES SECONDS N. The first file has a hinge or
// a slide for each coordinate; the second, unless it is "-", the first body with a free joint, whose coordinates are
// others: its own accelerations are left out there. Constraints, contacts and sensors are off. Two ways: mj_forward,
// and only what accelerations need (kinematics, composite inertia, its factors, the bias, a solution).
#include "tree.h"
#include <cmath>
#include <cstring>
#include <mujoco/mujoco.h>

static void quaternion(const State &s, double *p, double *rate)
{
    // axes x, y, z one after the other; the rate in the body's axes
    double half[3][4] = {{std::cos(s.q[3] / 2), std::sin(s.q[3] / 2), 0, 0},
                         {std::cos(s.q[4] / 2), 0, std::sin(s.q[4] / 2), 0},
                         {std::cos(s.q[5] / 2), 0, 0, std::sin(s.q[5] / 2)}},
           xy[4], back[4], e[3], sum[3];
    mju_mulQuat(xy, half[0], half[1]);
    mju_mulQuat(p, xy, half[2]);
    const double x[3] = {1, 0, 0}, y[3] = {0, 1, 0}, z[3] = {0, 0, 1};
    for (int i = 0; i < 3; i++)
        sum[i] = s.qd[3] * x[i];
    mju_rotVecQuat(e, y, half[0]);
    mju_addToScl3(sum, e, s.qd[4]);
    mju_rotVecQuat(e, z, xy);
    mju_addToScl3(sum, e, s.qd[5]);
    mju_negQuat(back, p);
    mju_rotVecQuat(rate, sum, back);
}

int main(int argc, char **argv)
{
    if (argc < 6)
        return 2;
    int n = std::atoi(argv[5]);
    std::vector<State> states = read_states(argv[3], n);
    double seconds = std::atof(argv[4]);
    for (int free = 0; free < 2; free++) {
        if (std::strcmp(argv[1 + free], "-") == 0)
            continue;
        char error[1000] = "";
        mjModel *m = mj_loadXML(argv[1 + free], nullptr, error, sizeof error);
        if (!m) {
            std::fprintf(stderr, "%s\n", error);
            return 1;
        }
        m->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_CONTACT | mjDSBL_SENSOR | mjDSBL_ACTUATION;
        mjData *d = mj_makeData(m);
        std::vector<std::vector<double>> qs, vs;
        for (const State &s : states) {
            std::vector<double> q = s.q, v = s.qd;
            if (free) {
                q.resize(static_cast<size_t>(n) + 1);
                quaternion(s, &q[3], &v[3]);
                std::copy(s.q.begin() + 6, s.q.end(), q.begin() + 7);
            }
            qs.push_back(q);
            vs.push_back(v);
        }
        for (int least = 0; least < 2; least++) {
            std::string name = std::string(least ? "MuJoCo, only what qacc needs" : "MuJoCo mj_forward") +
                               (free ? ", free joint" : ", hinges and slides");
            report(name.c_str(), states, seconds, free ? 6 : 0, [&](const State &s, std::vector<double> &qdd) {
                size_t k = static_cast<size_t>(&s - states.data());
                std::memcpy(d->qpos, qs[k].data(), qs[k].size() * sizeof(double));
                std::memcpy(d->qvel, vs[k].data(), vs[k].size() * sizeof(double));
                if (least) {
                    mj_kinematics(m, d);
                    mj_comPos(m, d);
                    mj_makeM(m, d);
                    mj_factorM(m, d);
                    mj_comVel(m, d);
                    mj_rne(m, d, 0, d->qfrc_bias);
                    mju_scl(d->qfrc_smooth, d->qfrc_bias, -1, m->nv);
                    mj_solveM(m, d, d->qacc, d->qfrc_smooth, 1);
                } else
                    mj_forward(m, d);
                qdd.assign(d->qacc, d->qacc + m->nv);
            });
        }
        mj_deleteData(d);
        mj_deleteModel(m);
    }
    return 0;
}
