/* ceres_shim.cc -- ceres_shim.h said in Ceres. */
#include "ceres_shim.h"

#include <ceres/ceres.h>

#include <exception>
#include <memory>
#include <utility>
#include <vector>

namespace
{

class Term : public ceres::CostFunction
{
  public:
    Term(const ceres_problem &problem, const ceres_term &term) : term_(term)
    {
        set_num_residuals(term.residuals);
        for (int k = 0; k < term.parameters; k++)
            mutable_parameter_block_sizes()->push_back(problem.parameter[term.parameter[k]].size);
    }
    bool Evaluate(double const *const *parameters, double *residuals,
                  double **jacobians) const override
    {
        return term_.evaluate(term_.context, parameters, residuals, jacobians);
    }

  private:
    const ceres_term &term_;
};

void add_parameter(ceres::Problem &to, const ceres_parameter &p)
{
    to.AddParameterBlock(p.value, p.size);
    std::vector<int> held;
    for (int i = 0; i < p.size; i++) {
        if (p.held && p.held[i])
            held.push_back(i);
        if (p.low)
            to.SetParameterLowerBound(p.value, i, p.low[i]);
        if (p.high)
            to.SetParameterUpperBound(p.value, i, p.high[i]);
    }
    if (static_cast<int>(held.size()) == p.size)
        to.SetParameterBlockConstant(p.value);
    else if (!held.empty())
        to.SetManifold(p.value, new ceres::SubsetManifold(p.size, held));
}

void build(ceres::Problem &to, const ceres_problem &problem)
{
    for (int i = 0; i < problem.parameters; i++)
        add_parameter(to, problem.parameter[i]);
    for (int i = 0; i < problem.terms; i++) {
        const ceres_term &term = problem.term[i];
        std::vector<double *> values;
        for (int k = 0; k < term.parameters; k++)
            values.push_back(problem.parameter[term.parameter[k]].value);
        ceres::LossFunction *loss = term.cauchy > 0 ? new ceres::CauchyLoss(term.cauchy) : nullptr;
        to.AddResidualBlock(new Term(problem, term), loss, values);
    }
}

void order(ceres::Solver::Options &options, const ceres_problem &problem)
{
    bool schur = false, rest = false;
    for (int i = 0; i < problem.parameters; i++)
        (problem.parameter[i].eliminate ? schur : rest) = true;
    options.linear_solver_type = schur && rest ? ceres::DENSE_SCHUR : ceres::DENSE_QR;
    if (!schur || !rest)
        return;
    auto groups = std::make_shared<ceres::ParameterBlockOrdering>();
    for (int i = 0; i < problem.parameters; i++)
        groups->AddElementToGroup(problem.parameter[i].value,
                                  problem.parameter[i].eliminate ? 0 : 1);
    options.linear_solver_ordering = groups;
}

}  // namespace

enum status ceres_solve(struct ceres_problem *problem, struct error *err)
{
    try {
        ceres::Problem ceres_problem;
        build(ceres_problem, *problem);
        ceres::Solver::Options options;
        order(options, *problem);
        options.max_num_iterations = problem->iterations > 0 ? problem->iterations : 100;
        options.function_tolerance = 1e-12;
        options.parameter_tolerance = 1e-10;
        options.gradient_tolerance = 0;
        options.num_threads = 1;
        options.logging_type = ceres::SILENT;
        ceres::Solver::Summary summary;
        ceres::Solve(options, &ceres_problem, &summary);
        problem->cost = summary.final_cost;
        if (!summary.IsSolutionUsable())
            return cap_fail(err, STATUS_SOLVER, "least squares: %s", summary.message.c_str());
        return STATUS_OK;
    } catch (const std::exception &e) {
        return cap_fail(err, STATUS_SOLVER, "least squares: %s", e.what());
    }
}

enum status ceres_covariance(struct ceres_problem *problem, struct error *err)
{
    try {
        ceres::Problem ceres_problem;
        build(ceres_problem, *problem);
        ceres::Covariance::Options options;
        options.algorithm_type = ceres::SPARSE_QR;
        // SuiteSparse's QR calls a threaded BLAS, whose sums differ in the last bits between runs.
        options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
        options.num_threads = 1;
        ceres::Covariance covariance(options);
        std::vector<std::pair<const double *, const double *>> blocks;
        for (int i = 0; i < problem->parameters; i++)
            if (problem->parameter[i].covariance)
                blocks.emplace_back(problem->parameter[i].value, problem->parameter[i].value);
        if (!covariance.Compute(blocks, &ceres_problem))
            return cap_fail(err, STATUS_DATA, "the measurements leave unknowns undetermined");
        for (int i = 0; i < problem->parameters; i++)
            if (problem->parameter[i].covariance)
                covariance.GetCovarianceBlock(problem->parameter[i].value,
                                              problem->parameter[i].value,
                                              problem->parameter[i].covariance);
        return STATUS_OK;
    } catch (const std::exception &e) {
        return cap_fail(err, STATUS_SOLVER, "covariance: %s", e.what());
    }
}
