"""The control loop of ``record``: compensation, admittance drag and the mock tutor."""
