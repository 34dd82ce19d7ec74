"""Pages of results for people: an identification and a diagnosis as HTML, with all their figures."""

from workbench.parts import Parts

PARTS = Parts(
    result_pages=(
        "workbench.extras.reports.pages:DiagnosisPage",
        "workbench.extras.reports.pages:IdentificationPage",
    )
)
