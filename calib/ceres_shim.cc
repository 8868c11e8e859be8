/* ceres_shim.cc -- ceres_shim.h said in Ceres. */
#include "ceres_shim.h"

#include <ceres/ceres.h>
#include <glog/logging.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <memory>
#include <vector>

namespace
{

// So few are evaluated sooner than threads wake up.
enum { FEW_TERMS = 256 };

// Ceres tells its callers what failed; its log would tell the user again, in other words.
const bool quiet = (FLAGS_minloglevel = google::GLOG_FATAL, true);

// All values in one array, in the order of the parameters: Ceres orders its work by address, and
// the addresses of the caller's arrays may differ from run to run, and with them the last bits.
class Values
{
  public:
    explicit Values(const ceres_problem &problem) : problem_(problem)
    {
        size_t count = 0;
        for (int i = 0; i < problem.parameters; i++)
            count += static_cast<size_t>(problem.parameter[i].size);
        value_.reserve(count);  // so that places in it stay where they are
        for (int i = 0; i < problem.parameters; i++) {
            const ceres_parameter &p = problem.parameter[i];
            at_.push_back(value_.data() + value_.size());
            value_.insert(value_.end(), p.value, p.value + p.size);
        }
    }
    double *operator[](int parameter) const
    {
        return at_[static_cast<size_t>(parameter)];
    }
    void give_back() const
    {
        for (int i = 0; i < problem_.parameters; i++)
            std::copy_n((*this)[i], problem_.parameter[i].size, problem_.parameter[i].value);
    }

  private:
    const ceres_problem &problem_;
    std::vector<double> value_;
    std::vector<double *> at_;
};

bool all_held(const ceres_parameter &p)
{
    int held = 0;
    for (int i = 0; p.held && i < p.size; i++)
        held += p.held[i];
    return held == p.size;
}

// A term, which may have been evaluated ahead at some values; asked at these it answers from
// memory.
class Term : public ceres::CostFunction
{
  public:
    Term(const ceres_problem &problem, const ceres_term &term, const Values &value)
        : term_(term), residual_(static_cast<size_t>(term.residuals))
    {
        set_num_residuals(term.residuals);
        for (int k = 0; k < term.parameters; k++) {
            const ceres_parameter &p = problem.parameter[term.parameter[k]];
            mutable_parameter_block_sizes()->push_back(p.size);
            value_[k] = value[term.parameter[k]];
            held_[k] = all_held(p);
            numbers_ += static_cast<size_t>(p.size);
        }
        at_.resize(numbers_);
    }
    // Room for derivatives, made by one thread: what it throws would not leave a team of them.
    void Reserve()
    {
        jacobian_.resize(residual_.size() * numbers_);
    }
    // At the values as they are now. Terms do not share what they write: any thread.
    void Ahead(bool derivatives)
    {
        double *by[CERES_TERM_PARAMETERS], *next = jacobian_.data(), *at = at_.data();
        for (int k = 0; k < term_.parameters; k++) {
            size_t size = static_cast<size_t>(parameter_block_sizes()[static_cast<size_t>(k)]);
            by[k] = held_[k] ? nullptr : next;
            next += derivatives ? residual_.size() * size : 0;
            at = std::copy_n(value_[k], size, at);
        }
        good_ = term_.evaluate(term_.context, value_, residual_.data(), derivatives ? by : nullptr);
        known_ = derivatives ? DERIVATIVES : RESIDUALS;
    }
    bool Evaluate(double const *const *parameters, double *residuals,
                  double **jacobians) const override
    {
        if (!Knows(parameters, jacobians))
            return term_.evaluate(term_.context, parameters, residuals, jacobians);
        std::copy(residual_.begin(), residual_.end(), residuals);
        const double *from = jacobian_.data();
        for (int k = 0; jacobians && k < term_.parameters; k++) {
            size_t size = residual_.size()
                          * static_cast<size_t>(parameter_block_sizes()[static_cast<size_t>(k)]);
            if (jacobians[k])
                std::copy_n(from, size, jacobians[k]);
            from += size;
        }
        return good_;
    }

  private:
    bool Knows(double const *const *parameters, double **jacobians) const
    {
        if (known_ == NOTHING || (jacobians && known_ != DERIVATIVES))
            return false;
        const double *at = at_.data();
        for (int k = 0; k < term_.parameters; k++) {
            size_t size = static_cast<size_t>(parameter_block_sizes()[static_cast<size_t>(k)]);
            if ((jacobians && jacobians[k] && held_[k])
                || std::memcmp(at, parameters[k], size * sizeof *at) != 0)
                return false;
            at += size;
        }
        return true;
    }

    const ceres_term &term_;
    const double *value_[CERES_TERM_PARAMETERS];
    bool held_[CERES_TERM_PARAMETERS];
    size_t numbers_ = 0;
    std::vector<double> residual_, jacobian_, at_;
    enum { NOTHING, RESIDUALS, DERIVATIVES } known_ = NOTHING;
    bool good_ = false;
};

// Ceres sums in one thread, in the order of terms; what it sums is made by all of them before.
class Ahead : public ceres::EvaluationCallback
{
  public:
    void PrepareForEvaluation(bool derivatives, bool) override
    {
        const int terms = static_cast<int>(term_.size());
#pragma omp parallel for schedule(dynamic, 32)
        for (int i = 0; i < terms; i++)
            term_[static_cast<size_t>(i)]->Ahead(derivatives);
    }
    void Add(Term *term)
    {
        term->Reserve();
        term_.push_back(term);
    }

  private:
    std::vector<Term *> term_;  // the problem's
};

void add_parameter(ceres::Problem &to, const ceres_parameter &p, double *value)
{
    to.AddParameterBlock(value, p.size);
    std::vector<int> held;
    for (int i = 0; i < p.size; i++) {
        if (p.held && p.held[i])
            held.push_back(i);
        if (p.low)
            to.SetParameterLowerBound(value, i, p.low[i]);
        if (p.high)
            to.SetParameterUpperBound(value, i, p.high[i]);
    }
    if (static_cast<int>(held.size()) == p.size)
        to.SetParameterBlockConstant(value);
    else if (!held.empty())
        to.SetManifold(value, new ceres::SubsetManifold(p.size, held));
}

// `ahead`, if any, learns of all terms.
void build(ceres::Problem &to, const ceres_problem &problem, const Values &value,
           Ahead *ahead = nullptr)
{
    for (int i = 0; i < problem.parameters; i++)
        add_parameter(to, problem.parameter[i], value[i]);
    for (int i = 0; i < problem.terms; i++) {
        const ceres_term &term = problem.term[i];
        std::vector<double *> values;
        for (int k = 0; k < term.parameters; k++)
            values.push_back(value[term.parameter[k]]);
        ceres::LossFunction *loss = term.cauchy > 0 ? new ceres::CauchyLoss(term.cauchy) : nullptr;
        Term *made = new Term(problem, term, value);
        to.AddResidualBlock(made, loss, values);
        if (ahead)
            ahead->Add(made);
    }
}

void order(ceres::Solver::Options &options, const ceres_problem &problem, const Values &value)
{
    bool schur = false, rest = false;
    for (int i = 0; i < problem.parameters; i++)
        (problem.parameter[i].eliminate ? schur : rest) = true;
    options.linear_solver_type = schur && rest ? ceres::DENSE_SCHUR : ceres::DENSE_QR;
    if (!schur || !rest)
        return;
    auto groups = std::make_shared<ceres::ParameterBlockOrdering>();
    for (int i = 0; i < problem.parameters; i++)
        groups->AddElementToGroup(value[i], problem.parameter[i].eliminate ? 0 : 1);
    options.linear_solver_ordering = groups;
}

}  // namespace

enum status ceres_solve(struct ceres_problem *problem, struct error *err)
{
    try {
        const Values value(*problem);
        Ahead ahead;
        ceres::Problem::Options shared;
        shared.evaluation_callback = problem->terms > FEW_TERMS ? &ahead : nullptr;
        ceres::Problem ceres_problem(shared);
        build(ceres_problem, *problem, value, shared.evaluation_callback ? &ahead : nullptr);
        ceres::Solver::Options options;
        order(options, *problem, value);
        options.max_num_iterations = problem->iterations > 0 ? problem->iterations : 100;
        options.function_tolerance = problem->tolerance > 0 ? problem->tolerance : 1e-12;
        options.parameter_tolerance = 1e-10;
        options.gradient_tolerance = 0;
        // Steps across a bound are cut at it; the search along them costs a quarter of the time.
        options.max_num_line_search_step_size_iterations = 0;
        options.num_threads = 1;
        options.logging_type = ceres::SILENT;
        ceres::Solver::Summary summary;
        ceres::Solve(options, &ceres_problem, &summary);
        value.give_back();
        problem->cost = summary.final_cost;
        if (!summary.IsSolutionUsable())
            return cap_fail(err, STATUS_SOLVER, "least squares: %s", summary.message.c_str());
        return STATUS_OK;
    } catch (const std::exception &e) {
        return cap_fail(err, STATUS_SOLVER, "least squares: %s", e.what());
    }
}
