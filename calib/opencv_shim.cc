/* opencv_shim.cc -- opencv_shim.h said in OpenCV. */
#include "opencv_shim.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include <exception>
#include <vector>

enum status opencv_pose(pose *view_from_world, double *rms, double (*point)[3],
                        double (*normalised)[2], int count, struct error *err)
{
    try {
        std::vector<cv::Point3d> world;
        std::vector<cv::Point2d> image, again;
        for (int i = 0; i < count; i++) {
            world.emplace_back(point[i][0], point[i][1], point[i][2]);
            image.emplace_back(normalised[i][0], normalised[i][1]);
        }
        const cv::Mat none, identity = cv::Mat::eye(3, 3, CV_64F);
        std::vector<cv::Mat> r, t;
        cv::solvePnPGeneric(world, image, identity, none, r, t, false, cv::SOLVEPNP_SQPNP);
        double best = INFINITY;
        for (size_t k = 0; k < r.size(); k++) {
            cv::projectPoints(world, r[k], t[k], identity, none, again);
            double error = cv::norm(image, again, cv::NORM_L2) / std::sqrt(count);
            if (!(error < best))
                continue;
            best = error;
            const double *a = r[k].ptr<double>(), *b = t[k].ptr<double>();
            view_from_world->rotation = {a[0], a[1], a[2]};
            view_from_world->translation = {b[0], b[1], b[2]};
        }
        if (!(best < INFINITY))
            return cap_fail(err, STATUS_SOLVER, "no pose explains the points");
        *rms = best;
        return STATUS_OK;
    } catch (const std::exception &e) {
        return cap_fail(err, STATUS_SOLVER, "pose: %s", e.what());
    }
}

enum status opencv_square(pose view_from_tag[2], double side, double (*normalised)[2],
                          struct error *err)
{
    try {
        const double h = side / 2;
        const std::vector<cv::Point3d> world{{-h, h, 0}, {h, h, 0}, {h, -h, 0}, {-h, -h, 0}};
        std::vector<cv::Point2d> image;
        for (int k = 3; k >= 0; k--)  // OpenCV begins at the top left
            image.emplace_back(normalised[k][0], normalised[k][1]);
        const cv::Mat none, identity = cv::Mat::eye(3, 3, CV_64F);
        std::vector<cv::Mat> r, t;
        cv::solvePnPGeneric(world, image, identity, none, r, t, false, cv::SOLVEPNP_IPPE_SQUARE);
        if (r.empty())
            return cap_fail(err, STATUS_SOLVER, "no pose explains the tag");
        for (size_t k = 0; k < 2; k++) {
            const double *a = r[k < r.size() ? k : 0].ptr<double>();
            const double *b = t[k < t.size() ? k : 0].ptr<double>();
            view_from_tag[k] = {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}};
        }
        return STATUS_OK;
    } catch (const std::exception &e) {
        return cap_fail(err, STATUS_SOLVER, "pose of a tag: %s", e.what());
    }
}
