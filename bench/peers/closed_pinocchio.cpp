// SPDX-License-Identifier: BSD-3-Clause
// A mechanism with closed loops by Pinocchio: closed_pinocchio TREE T_END TOLERANCE ... Each loop is a contact of two
// points (CONTACT_3D) of constraintDynamics, its rows that a plane mechanism does not need left to the proximal
// iteration; no stabilisation, which makes the loops open slower than the error grows over short runs. Integrated by
// the embedded Runge-Kutta pair of Dormand and Prince of order 5. A line a tolerance: it, seconds of a run (median), q
// at the end.
#include "tree.h"
#include <cmath>
#include <pinocchio/algorithm/constrained-dynamics.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/multibody.hpp>

namespace pin = pinocchio;
using Vector = Eigen::VectorXd;

struct Mechanism {
    const Tree &tree;
    pin::Model model;
    std::vector<pin::JointIndex> joint;
    PINOCCHIO_STD_VECTOR_WITH_EIGEN_ALLOCATOR(pin::RigidConstraintModel) contacts;
    PINOCCHIO_STD_VECTOR_WITH_EIGEN_ALLOCATOR(pin::RigidConstraintData) contact_data;
    pin::Data data;
    pin::ProximalSettings settings{1e-14, 1e-12, 10};
    Vector tau;
    long calls = 0;

    pin::JointIndex at(int k) const
    {
        return k < 0 ? 0 : joint[static_cast<size_t>(k)];
    }

    static Eigen::Vector3d vec(const Triple &x)
    {
        return {x[0], x[1], x[2]};
    }

    explicit Mechanism(const Tree &given) : tree(given)
    {
        model.gravity.linear() = vec(tree.gravity);
        for (const TreeBody &b : tree.bodies) {
            // one revolute joint about z each: plane mechanisms
            pin::SE3 place(Eigen::Matrix3d::Identity(), vec(b.at));
            joint.push_back(model.addJoint(at(b.parent), pin::JointModelRZ(), place, b.name));
            const auto &i = b.inertia;
            Eigen::Matrix3d about;
            about << i[0], i[3], i[4], i[3], i[1], i[5], i[4], i[5], i[2];
            model.appendBodyToJoint(joint.back(), pin::Inertia(b.mass, vec(b.com), about), pin::SE3::Identity());
        }
        for (const Pair &c : tree.closures)
            contacts.emplace_back(pin::CONTACT_3D, model, at(c.a), pin::SE3(Eigen::Matrix3d::Identity(), vec(c.pa)),
                                  at(c.b), pin::SE3(Eigen::Matrix3d::Identity(), vec(c.pb)), pin::LOCAL);
        for (const auto &c : contacts)
            contact_data.emplace_back(c);
        data = pin::Data(model);
        tau = Vector::Zero(model.nv);
        pin::initConstraintDynamics(model, data, contacts, contact_data);
    }

    // Efforts of the springs: their moment about each hinge towards the ground.
    void push(pin::JointIndex k, const Eigen::Vector3d &point, const Eigen::Vector3d &force)
    {
        for (; k > 0; k = model.parents[k])
            tau[static_cast<Eigen::Index>(k) - 1] +=
                data.oMi[k].rotation().col(2).dot((point - data.oMi[k].translation()).cross(force));
    }

    void operator()(const Vector &y, Vector &dy)
    {
        Eigen::Index n = model.nv;
        Vector q = y.head(n), v = y.tail(n);
        calls++;
        tau.setZero();
        for (const auto &e : tree.efforts)
            tau[e.first] += e.second;
        for (const Held &s : tree.held)
            tau[s.k] -= s.stiffness * (q[s.k] - s.rest) + s.damping * v[s.k];
        if (!tree.springs.empty())
            pin::forwardKinematics(model, data, q);
        for (const Pair &s : tree.springs) {
            Eigen::Vector3d a = data.oMi[at(s.a)].act(vec(s.pa)), b = data.oMi[at(s.b)].act(vec(s.pb)), d = b - a;
            Eigen::Vector3d pull = d * (s.stiffness * (1 - s.length / d.norm()));
            push(at(s.a), a, pull);
            push(at(s.b), b, -pull);
        }
        dy.head(n) = v;
        dy.tail(n) = pin::constraintDynamics(model, data, q, v, tau, contacts, contact_data, settings);
    }
};

// Dormand and Prince 1980, with the step size of Hairer, Norsett and Wanner, II.4. false: too many steps.
static bool integrate(Mechanism &f, Vector &y, double end, double tolerance)
{
    static const double c[7][6] = {{},
                                   {1. / 5},
                                   {3. / 40, 9. / 40},
                                   {44. / 45, -56. / 15, 32. / 9},
                                   {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
                                   {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
                                   {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84}},
                        e[7] = {71. / 57600, 0, -71. / 16695, 71. / 1920, -17253. / 339200, 22. / 525, -1. / 40};
    Vector k[7], next(y.size()), off(y.size());
    for (Vector &x : k)
        x.resize(y.size());
    double t = 0, h = end / 1000;
    f(y, k[0]);
    for (long step = 0; t < end; step++) {
        if (step > 2000000 || !std::isfinite(h))
            return false;
        h = std::min(h, end - t);
        for (int s = 1; s < 7; s++) {
            next = y;
            for (int i = 0; i < s; i++)
                next += h * c[s][i] * k[i];
            f(next, k[s]);
        }
        off.setZero();
        for (int s = 0; s < 7; s++)
            off += h * e[s] * k[s];
        double sum = 0;
        for (Eigen::Index i = 0; i < y.size(); i++) {
            double w = tolerance * (1 + std::max(std::abs(y[i]), std::abs(next[i])));
            sum += off[i] * off[i] / (w * w);
        }
        double error = std::sqrt(sum / static_cast<double>(y.size()));
        if (error <= 1) {
            t = h == end - t ? end : t + h;
            y = next;
            k[0] = k[6];
        }
        h *= std::min(5., std::max(0.2, 0.9 * std::pow(std::max(error, 1e-10), -0.2)));
    }
    return true;
}

int main(int argc, char **argv)
{
    if (argc < 4)
        return 2;
    Tree tree = read_tree(argv[1]);
    double end = std::atof(argv[2]);
    for (int k = 3; k < argc; k++) {
        Mechanism mechanism(tree);
        Vector start(2 * tree.n), y;
        for (int i = 0; i < tree.n; i++) {
            start[i] = tree.q[static_cast<size_t>(i)];
            start[tree.n + i] = tree.qd[static_cast<size_t>(i)];
        }
        std::vector<double> seconds;
        bool ok = true;
        for (double spent = 0; ok && seconds.size() < 5 && spent < 2; spent += seconds.back()) {
            y = start;
            double begin = cpu_now();
            ok = integrate(mechanism, y, end, std::atof(argv[k]));
            seconds.push_back(cpu_now() - begin);
        }
        std::sort(seconds.begin(), seconds.end());
        std::printf("%s %.6g", argv[k], seconds[seconds.size() / 2]);
        for (int i = 0; ok && i < tree.n; i++)
            std::printf(" %.17g", y[i]);
        std::printf("\n");
        std::fflush(stdout);
    }
    return 0;
}
