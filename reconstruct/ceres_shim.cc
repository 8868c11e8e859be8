/* ceres_shim.cc -- bounded robust least squares by Ceres, behind plain C. */
#include "ceres_shim.h"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <cmath>
#include <exception>

namespace
{

// Ceres tells its callers what failed; its log would tell the user again, in other words.
const bool quiet = (FLAGS_minloglevel = google::GLOG_FATAL, true);

class PointCost : public ceres::CostFunction
{
  public:
    PointCost(const least_squares *problem, int point) : problem_(problem), point_(point)
    {
        set_num_residuals(problem->residuals);
        mutable_parameter_block_sizes()->push_back(problem->size);
    }
    bool Evaluate(double const *const *parameters, double *residuals,
                  double **jacobians) const override
    {
        problem_->residual(problem_->context, point_, parameters[0], residuals,
                           jacobians ? jacobians[0] : nullptr);
        return true;
    }

  private:
    const least_squares *problem_;
    int point_;
};

// (s + e^2)^(1/3) of s = |r|^2, less its value at 0.
class CubeRoot : public ceres::LossFunction
{
  public:
    void Evaluate(double s, double rho[3]) const override
    {
        const double even = CUBE_ROOT_EVEN * CUBE_ROOT_EVEN, root = std::cbrt(s + even);
        rho[0] = root - std::cbrt(even);
        rho[1] = root / (3 * (s + even));
        rho[2] = -2 * rho[1] / (3 * (s + even));
    }
};

}  // namespace

enum status rec_least_squares(struct least_squares *problem, struct error *err)
{
    try {
        ceres::CauchyLoss cauchy(problem->scale > 0 ? problem->scale : 1);
        CubeRoot cube_root;
        ceres::LossFunction *loss = &cube_root;
        if (problem->scale != 0)
            loss = problem->scale > 0 ? &cauchy : nullptr;
        ceres::Problem::Options ownership;
        ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
        ceres::Problem ceres_problem(ownership);
        ceres_problem.AddParameterBlock(problem->parameters, problem->size);
        for (int i = 0; i < problem->points; i++)
            ceres_problem.AddResidualBlock(new PointCost(problem, i), loss, problem->parameters);
        for (int k = 0; k < problem->size; k++) {
            ceres_problem.SetParameterLowerBound(problem->parameters, k, problem->low[k]);
            ceres_problem.SetParameterUpperBound(problem->parameters, k, problem->high[k]);
        }
        ceres::Solver::Options options;
        options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
        options.max_num_iterations = problem->iterations;
        options.num_threads = 1;
        options.logging_type = ceres::SILENT;
        ceres::Solver::Summary summary;
        ceres::Solve(options, &ceres_problem, &summary);
        if (!summary.IsSolutionUsable())
            return cap_fail(err, STATUS_SOLVER, "fit: %s", summary.message.c_str());
        problem->cost = summary.final_cost;
        return STATUS_OK;
    } catch (const std::exception &e) {
        return cap_fail(err, STATUS_SOLVER, "fit: %s", e.what());
    }
}
